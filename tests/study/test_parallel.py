"""Shares of a study in separate processes, alone or under JAX's distributed runtime."""

import json
import os
import socket
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from martths_jax import InputError
from martths_jax.campaign.distributed import join
from martths_jax.campaign.run import share_of
from martths_jax.study import Reporter, merge_runs, open_study, run_study
from tests.study.places import ONE_BLOCK, result_bytes, short_motion, small

ROOT = Path(__file__).resolve().parents[2]
#: A process of a study: runs its share, as the command line does.
WORKER = """
import sys
sys.path.insert(0, {root!r})
from martths_jax.campaign import provenance
from martths_jax.study import run_study
from martths_jax.campaign.distributed import join
from tests.study.places import ONE_BLOCK, small
provenance.git_commit = lambda: "0000000"
met = join("localhost:{port}", 2, {number})
settings = small({folder!r}, trials=300, memory_gb=ONE_BLOCK)
done = run_study(settings, share=met.share, together=met)
assert (done is not None) == ({number} == 0)
"""


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    folder = tmp_path_factory.mktemp("whole")
    return run_study(small(folder, trials=300, memory_gb=ONE_BLOCK))


def free_port() -> int:
    with socket.socket() as s:
        s.bind(("localhost", 0))
        return s.getsockname()[1]


@pytest.mark.slow
def test_two_processes_of_the_distributed_runtime(whole, tmp_path, compile_cache):
    port = free_port()
    environment = compile_cache | {"MARTHS_DEVICES": "1"}
    workers = [
        subprocess.Popen(
            [sys.executable, "-c",
             WORKER.format(root=str(ROOT), port=port, number=i, folder=str(tmp_path))],
            env=environment, stderr=subprocess.PIPE, text=True,
        )
        for i in range(2)
    ]  # fmt: skip
    errors = [w.communicate(timeout=300)[1] for w in workers]
    assert [w.returncode for w in workers] == [0, 0], errors
    assert open_study(tmp_path).dataset.attrs == whole.dataset.attrs
    assert result_bytes(tmp_path) == result_bytes(whole.folder)
    sessions = json.loads((tmp_path / "provenance.json").read_text())["sessions"]
    assert sorted(s["trials"] for s in sessions) == [2 * 150, 2 * 151]


def test_shares_merge_into_the_whole(whole, tmp_path):
    settings = small(tmp_path / "a", trials=300, memory_gb=ONE_BLOCK)
    assert run_study(settings, share=(1, 3)) is None
    assert run_study(settings, share=(3, 3)) is None
    with pytest.raises(InputError, match=r"passthrough on two: trials 100-199 are missing"):
        merge_runs(tmp_path / "a")
    assert run_study(settings | {"out": str(tmp_path / "b")}, share=(2, 3)) is None
    said = []
    merged = merge_runs(tmp_path / "all", [tmp_path / "a", tmp_path / "b"], reporter=Says(said))
    assert result_bytes(tmp_path / "all") == result_bytes(whole.folder)
    assert merged.dataset.equals(open_study(tmp_path / "all").dataset)
    # These motions are objects of this test, so the merged study cannot be run again.
    assert any("No signals are stored" in text for text in said)


class Says:
    def __init__(self, into):
        self.notice = into.append


def test_shares_of_different_studies_do_not_merge(whole, tmp_path):
    run_study(small(tmp_path / "other", motions=(short_motion("one"),)), share=(1, 1))
    with pytest.raises(InputError, match="holds another study"):
        merge_runs(tmp_path / "all", [whole.folder, tmp_path / "other"])
    with pytest.raises(InputError, match="holds no study"):
        merge_runs(tmp_path / "all", [tmp_path / "nothing"])


@pytest.mark.parametrize("shares", [1, 2, 7, 16])
def test_every_trial_is_in_one_share(shares):
    parts = [share_of(101, (i, shares)) for i in range(1, shares + 1)]
    assert np.array_equal(np.sum(parts, axis=0), np.ones(101))
    sizes = [p.sum() for p in parts]
    assert max(sizes) - min(sizes) <= 1
    with pytest.raises(InputError, match="share"):
        share_of(101, (shares + 1, shares))


def test_fresh_is_refused_for_a_share(tmp_path):
    with pytest.raises(InputError, match="fresh"):
        run_study(small(tmp_path), share=(1, 2), fresh=True)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("host:1", None, None), "--num-processes is missing"),
        ((None, 2, 0), "--coordinator is missing"),
        (("host:1", 2, 2), r"must lie in 0 \.\.\. 1"),
    ],
)
def test_incomplete_options_are_named(options, message):
    with pytest.raises(InputError, match=message):
        join(*options)


def test_a_process_alone_says_what_it_misses():
    if os.environ.get("SLURM_JOB_ID"):
        pytest.skip("is about a machine without a cluster's variables")
    with pytest.raises(InputError, match="cannot be joined"):
        join(None, None, None)


def attend(*processes):
    """What joining comes to for each (port, processes, number), side by side; dies: how it ends."""

    def one(port, count, number, timeout=30.0, dies=False):
        try:
            met = join(f"localhost:{port}", count, number, timeout)
            if dies:  # what the system does for a process that ends
                met.close()
                return "died"
            met.finish(Reporter())
        except InputError as error:
            return str(error)
        return met.share

    with ThreadPoolExecutor(len(processes)) as pool:
        return list(pool.map(lambda p: one(*p), processes))


def test_processes_meet_and_part():
    port = free_port()
    assert attend(*((port, 3, i) for i in range(3))) == [(1, 3), (2, 3), (3, 3)]


def test_a_wrong_coordinator_and_a_process_alone_end_in_words():
    lost, alone = attend((1, 2, 1, 1.0), (free_port(), 2, 0, 1.0))
    assert "nothing answered at localhost:1 within 1 s" in lost
    assert "of 2 processes, number 1 did not come" in alone and "--join-timeout" in alone


def test_a_doubled_process_ends_in_words():
    port = free_port()
    found = attend(*((port, 3, i) for i in (0, 1, 1)))
    assert all("process 1 came twice" in text for text in found)


def test_a_process_that_ends_early_is_named():
    port = free_port()
    first, died, last = attend((port, 3, 0), (port, 3, 1, 30.0, True), (port, 3, 2))
    assert died == "died" and last == (3, 3)
    assert "Process 1 (process" in first and "ended before its share was done" in first
    port = free_port()
    died, last = attend((port, 2, 0, 30.0, True), (port, 2, 1))
    assert "Process 0 ended before it had written the results" in last


def test_another_number_of_processes_is_said():
    port = free_port()
    found = attend((port, 2, 0), (port, 3, 1))
    assert all("(--num-processes)" in text for text in found)


@pytest.mark.parametrize("address", ["host", "host:", ":80", "host:x", "host:99999"])
def test_an_address_is_host_and_port(address):
    with pytest.raises(InputError, match="HOST:PORT"):
        join(address, 2, 1)
