"""A tool that is missing skips a test at home and fails it in continuous integration."""

import subprocess
from pathlib import Path
from types import SimpleNamespace

import pytest

from tests import conftest
from tests.report import chromium
from tests.tools import missing

ROOT = Path(__file__).resolve().parents[1]


@pytest.mark.parametrize(("value", "outcome"), [("true", pytest.fail), ("", pytest.skip)])
def test_a_missing_tool(monkeypatch, value, outcome):
    monkeypatch.setenv("CI", value)
    with pytest.raises(outcome.Exception, match=r"no hammer was found.* buy one"):
        missing("no hammer was found", "buy one")


@pytest.fixture
def machine(tmp_path):
    """Commands of a machine without tools, whose `apt-get` and `make` write down what they do."""
    for name in ("bash", "dirname", "id", "env", "sh"):
        (tmp_path / name).symlink_to(f"/usr/bin/{name}")

    def command(name: str, code: str) -> None:
        (tmp_path / name).write_text(f"#!/bin/sh\n{code}\n")
        (tmp_path / name).chmod(0o755)

    command("make", f'echo "CI=$CI make $*" >> {tmp_path}/said')
    command("sudo", 'shift; exec "$@"')
    command("apt-get", f'echo "apt-get $*" >> {tmp_path}/said')

    def run(**environment):
        done = subprocess.run(["bash", str(ROOT / ".ci" / "run")], capture_output=True, text=True,
                              env={"PATH": str(tmp_path)} | environment)  # fmt: skip
        said = tmp_path / "said"
        return done, said.read_text().splitlines() if said.exists() else []

    run.command = command
    return run


@pytest.mark.skipif(not Path("/usr/bin/bash").exists(), reason="is about Linux")
def test_continuous_integration_installs_what_is_missing(machine):
    done, said = machine()
    assert done.returncode == 0, done.stderr
    assert said[0].startswith("apt-get update") and said[-1] == "CI=true make test"
    for package in ("chromium", "gcc", "libc6-dev"):
        assert f" {package}" in said[1]
    for name in ("cc", chromium.NAMES[1]):
        machine.command(name, "true")
    assert machine()[1][3:] == ["CI=true make test"]


@pytest.mark.skipif(not Path("/usr/bin/bash").exists(), reason="is about Linux")
def test_continuous_integration_says_what_it_cannot_install(machine):
    machine.command("apt-get", "exit 100")
    done, said = machine(MARTHS_CHROMIUM="/somewhere")
    assert done.returncode == 1 and said == []
    assert "need gcc libc6-dev (Debian's names)" in done.stderr


class _Items:
    """What ``pytest_collection_modifyitems`` asks of a configuration."""

    def __init__(self, args=("tests",), everything=False, markexpr=""):
        self.args = args
        self.option = SimpleNamespace(all=everything, markexpr=markexpr)
        self.left_out = []
        self.hook = SimpleNamespace(pytest_deselected=lambda items: self.left_out.extend(items))


@pytest.mark.parametrize(
    ("config", "ci", "runs"),
    [
        (_Items(), "", ["quick"]),
        (_Items(), "true", ["quick", "slow"]),
        (_Items(everything=True), "", ["quick", "slow"]),
        (_Items(args=("tests/test_a.py::slow",)), "", ["quick", "slow"]),
        (_Items(markexpr="slow"), "", ["quick", "slow"]),
    ],
)
def test_slow_tests_run_in_ci_and_when_asked_for(monkeypatch, config, ci, runs):
    monkeypatch.setenv("CI", ci)
    both = [
        SimpleNamespace(name=name, get_closest_marker=lambda mark, n=name: n == mark)
        for name in ("quick", "slow")
    ]
    items = list(both)
    conftest.leave_slow_out(config, items)
    assert [item.name for item in items] == runs
    assert config.left_out == [item for item in both if item.name not in runs]
