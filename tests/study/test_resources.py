"""The memory that may be taken: the machine's, control groups' of both versions, the process's."""

import subprocess
import sys
from pathlib import Path

import psutil
import pytest

from martths_jax import InputError, checks, resources
from martths_jax.campaign import memory as study_memory
from martths_jax.campaign.memory import choose_chunk
from martths_jax.motions import checks as motion_checks
from martths_jax.resources import available_memory

MACHINE = 64e9


@pytest.fixture
def system(tmp_path, monkeypatch):
    """Writes files of a system with 64 GB free, and says what is available there."""
    memory = type("Memory", (), {"available": MACHINE})()
    monkeypatch.setattr(psutil, "virtual_memory", lambda: memory)
    monkeypatch.setattr(resources, "GROUPS_FILE", tmp_path / "cgroup")
    monkeypatch.setattr(resources, "GROUPS", tmp_path / "groups")
    monkeypatch.setattr(resources, "_own_rooms", lambda: iter(()))

    def write(group: str, files: dict[str, object]) -> float:
        (tmp_path / "cgroup").write_text(group)
        for name, value in files.items():
            path = tmp_path / "groups" / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(f"{value}\n")
        return available_memory()

    return write


def test_without_groups_it_is_the_machines(system, monkeypatch):
    assert system("", {}) == MACHINE
    assert system("0::/\n", {"memory.stat": "inactive_file 5"}) == MACHINE
    assert system("12:cpu:/x\nrubbish\n", {"x/memory.max": 10, "x/memory.current": 1}) == MACHINE
    monkeypatch.setattr(resources, "GROUPS_FILE", Path("/no/such/file"))
    assert available_memory() == MACHINE


def test_a_group_of_version_2_and_all_around_it(system):
    files = {"job/step/memory.max": "max", "job/step/memory.current": 10**9}
    assert system("0::/job/step\n", files) == MACHINE
    # A batch job's limit is the parent's; cached files give way.
    stat = {"job/memory.stat": f"anon 7\ninactive_file {10**9}\nfile 8"}
    around = {"job/memory.max": 8 * 10**9, "job/memory.current": 3 * 10**9}
    assert system("0::/job/step\n", files | around) == 5e9
    assert system("0::/job/step\n", files | around | stat) == 6e9
    # Beyond `high` the system stalls a group.
    assert system("0::/job/step\n", {"job/memory.high": 4 * 10**9}) == 2e9
    assert system("0::/job/step\n", {"job/memory.current": 9 * 10**9}) == 0.0


def test_a_group_of_version_1(system):
    files = {"memory/a/memory.limit_in_bytes": 2 * 10**9, "memory/a/memory.usage_in_bytes": 10**9}
    assert system("3:cpu:/a\n4:memory:/a\n0::/\n", files) == 1e9
    unlimited = {"memory/a/memory.limit_in_bytes": 9223372036854771712}
    assert system("4:memory:/a\n", unlimited) == MACHINE
    stat = {"memory/a/memory.stat": f"total_inactive_file {3 * 10**8}"}
    assert system("4:memory:/a\n", files | stat) == 1.3e9


@pytest.mark.parametrize("place", ["/docker/0123", "/../0123"])
def test_a_container_sees_its_group_as_the_root(system, place):
    limits = {"memory.max": 10**9, "memory.current": 4 * 10**8}
    assert system(f"0::{place}\n", limits) == 6e8


def test_everything_that_asks_for_memory_asks_here(system):
    system("0::/\n", {"memory.max": 10**8, "memory.current": 5 * 10**7})
    with pytest.raises(InputError, match=r"0\.05 GB are free"):
        choose_chunk(52_162, 1, 128, 2)
    with pytest.raises(InputError, match="needs 1e\\+06 samples"):
        motion_checks.check_memory(1e6, "Motion x")
    for module in (checks, motion_checks, study_memory):
        assert module.available_memory is available_memory
    package = Path(resources.__file__).parent
    using = [p for p in package.rglob("*.py") if "virtual_memory" in p.read_text("utf-8")]
    assert using == [package / "resources.py"]


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux bounds the address space")
def test_the_bound_on_the_address_space_counts():
    code = (
        "import resource, runpy\n"
        "resource.setrlimit(resource.RLIMIT_AS, (2 * 10**9, 2 * 10**9))\n"
        f"print(runpy.run_path({resources.__file__!r})['available_memory']())"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert 0 < float(done.stdout) < 2e9
