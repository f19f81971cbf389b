"""A running folder has an owner: whoever comes second is told, nothing is mixed or lost."""

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from martths_jax import InputError, claims
from martths_jax.campaign.owner import Owner, door, owned, owners
from martths_jax.files import atomic, sweep
from martths_jax.study import run_study
from tests.study.places import ONE_BLOCK, result_bytes, small

ROOT = Path(__file__).resolve().parents[2]
#: Runs a study and stops itself after its first part.
PAUSED = """
import os, signal, sys
sys.path.insert(0, {root!r})
from martths_jax import InputError
from martths_jax.campaign import provenance
from martths_jax.study import Reporter, run_study
from tests.study.places import small, ONE_BLOCK
provenance.git_commit = lambda: "0000000"

class Stops(Reporter):
    def advanced(self, cell, tally):
        os.kill(os.getpid(), signal.SIGSTOP)
        self.advanced = lambda cell, tally: None

try:
    run_study(small({folder!r}, trials=300, memory_gb=ONE_BLOCK), reporter=Stops())
except InputError as error:
    print(error)
    sys.exit(2)
"""


def paused(folder, environment):
    """A study that has stored its first part and stands still."""
    code = PAUSED.format(root=str(ROOT), folder=str(folder))
    process = subprocess.Popen(
        [sys.executable, "-c", code], env=environment, stdout=subprocess.PIPE, text=True
    )
    assert os.WIFSTOPPED(os.waitpid(process.pid, os.WUNTRACED)[1])
    return process


@pytest.mark.slow
def test_whoever_comes_second_is_told(tmp_path, compile_cache):
    folder = tmp_path / "run"
    process = paused(folder, compile_cache)
    try:
        for changes, fresh in (({}, False), ({"seed": 2}, True), ({"trials": 600}, False)):
            asked = small(folder, trials=300) | changes
            with pytest.raises(InputError, match=rf"in use.*process {process.pid} on"):
                run_study(asked, fresh=fresh)
        assert len(list(folder.rglob("*.npz"))) == 1
        # Removed under it, and another study in its place: neither knows of the other.
        shutil.rmtree(folder)
        run_study(small(folder, seed=2))
        before = result_bytes(folder)
        process.send_signal(signal.SIGCONT)
        text = process.communicate(timeout=120)[0]
        assert process.returncode == 2 and "was removed, moved or taken over" in text
        run_study(small(folder, seed=2))
        assert result_bytes(folder) == before
    finally:
        process.kill()


def test_a_dead_owner_is_no_owner(tmp_path):
    code = (
        "import os; from pathlib import Path\n"
        "from martths_jax.files import scratch\n"
        "from martths_jax.campaign.owner import owned\n"
        f"folder = Path({str(tmp_path)!r})\n"
        "with owned(folder, 'dies'), scratch(folder / 'study.nc') as part:\n"
        "    part.write_text('half')\n"
        "    os.kill(os.getpid(), 9)\n"
    )
    subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=False)
    left = [p.name for p in tmp_path.rglob("*")]
    assert "part.nc" in left and "claim" in left
    with owned(tmp_path, "next") as owner:
        assert owner.alone
    assert not list(tmp_path.iterdir())


def test_what_a_living_process_writes_is_left_alone(tmp_path):
    (tmp_path / "run.json").write_text("{}")
    with atomic(tmp_path / "report.html") as part:
        part.write_text("half")
        assert part.parent.parent == tmp_path / ".martths" / "tmp"
        sweep(tmp_path)
        assert part.exists()
        part.write_text("whole")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["report.html", "run.json"]


def test_shares_share_and_nobody_else(tmp_path):
    with door(tmp_path):
        one, two = Owner(tmp_path, True, "one"), Owner(tmp_path, True, "two")
        assert one.alone and not two.alone and len(owners(tmp_path)) == 2
        with pytest.raises(InputError, match="in use"):
            Owner(tmp_path, False, "three")
    one.release()
    two.release()
    with owned(tmp_path, "alone"), door(tmp_path), pytest.raises(InputError, match="`alone`"):
        Owner(tmp_path, True, "share")
    assert not list(tmp_path.iterdir())


def test_shares_are_not_extended_under_each_other(tmp_path):
    run_study(small(tmp_path, memory_gb=ONE_BLOCK), share=(1, 2))
    with door(tmp_path):
        other = Owner(tmp_path, True, "share 2/2")
    with pytest.raises(InputError, match="cannot be extended to 40 trials"):
        run_study(small(tmp_path, trials=40), share=(1, 2))
    other.release()
    run_study(small(tmp_path, trials=40), share=(1, 2))


def test_a_door_that_nobody_leaves(tmp_path, monkeypatch):
    monkeypatch.setattr("martths_jax.campaign.owner.PATIENCE", 0.1)
    with door(tmp_path), pytest.raises(InputError, match="being changed by another process"):
        with door(tmp_path):
            pass


def test_many_come_and_go_at_once(tmp_path):
    """Whoever leaves takes empty folders along, which must not trip who comes just then."""
    (tmp_path / "run.json").write_text("{}")

    def come_and_go(number):
        for i in range(100):
            with door(tmp_path):
                pass
            with atomic(tmp_path / f"{number}.txt") as part:
                part.write_text(str(i))

    with ThreadPoolExecutor(4) as pool:
        list(pool.map(come_and_go, range(4)))
    with door(tmp_path):  # whoever leaves last, with nobody writing, takes all along
        pass
    left = sorted(p.name for p in tmp_path.iterdir())
    assert left == ["0.txt", "1.txt", "2.txt", "3.txt", "run.json"]


@pytest.mark.parametrize(
    ("locked", "changes", "age", "held"),
    [
        (True, {}, 0, True),  # locked: whoever it is
        (True, {"boot": "other", "host": "other"}, 1e6, True),
        (False, {}, 0, False),  # of this machine, and not locked
        (False, {"host": "container"}, 0, False),  # a container here, of the same kernel
        (False, {"boot": "other", "host": "other"}, 10, True),  # its lock may not be seen here
        (False, {"boot": "other", "host": "other"}, 1000, False),  # not renewed for long
        (None, {}, 1e6, True),  # no locks: this very process
        (None, {"process_started": "1"}, 0, False),  # the number was given to another process
        (None, {"process": 2**22 + 5}, 0, False),
        (False, {"boot": "other"}, 10, True),  # equal host name and process number elsewhere
    ],
)
def test_who_holds_a_claim(locked, changes, age, held):
    assert claims._is_held(locked, claims.me() | changes, age) == held


def test_a_claim_is_renewed_for_other_hosts(tmp_path, monkeypatch):
    monkeypatch.setattr(claims, "RENEWED", 0.02)
    claim = claims.Claim(tmp_path / "claim", renew=True)
    os.utime(tmp_path / "claim", (1, 1))
    deadline = time.monotonic() + 5
    while (tmp_path / "claim").stat().st_mtime < 100 and time.monotonic() < deadline:
        time.sleep(0.01)
    assert (tmp_path / "claim").stat().st_mtime > 100
    assert json.loads((tmp_path / "claim").read_text())["process"] == os.getpid()
    claim.release()
    assert not (tmp_path / "claim").exists()
