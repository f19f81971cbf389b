"""What passes, what is reported, and what the checks drive a controller with."""

import json
import re
from pathlib import Path

import jax
import numpy as np
import pytest
from typer.testing import CliRunner

from martths_jax import ADFC, Compensator, InputError, SensorNoise, draw_plants
from martths_jax.cli import app
from martths_jax.conformity import Finding, Report, check, run, stand, strokes
from martths_jax.structure.modal import to_dense
from tests.conformity import broken
from tests.engine.motions import burst

NAMES = [name for one in run.CHECKS for name in one.names]
SOUND = {
    "lqg": "lqg",
    "passthrough": "passthrough",
    "adfc": "short=adfc{nb=48,no=40}",
    "own": broken.Sound(gain=0.2),
}


@pytest.mark.parametrize("given", SOUND.values(), ids=SOUND)
def test_sound_ones_pass(given, benchmark, monkeypatch):
    """But for their gradients, which take longest to compile, and the loop."""
    chosen = tuple(one for one in run.CHECKS if one.names != ("gradient",))
    monkeypatch.setattr(run, "CHECKS", chosen)
    told = []
    report = check(given, benchmark, quick=True, progress=lambda *done: told.append(done))
    assert report.passed, report.verdict
    left_out = {f.name for f in report.findings if f.passed is None}
    assert left_out == {name for one in chosen if one.loop for name in one.names}
    assert report["cost"].value > 0
    assert told == [(i + 1, len(chosen)) for i in range(len(chosen))]


@pytest.mark.slow
@pytest.mark.parametrize("given", SOUND.values(), ids=SOUND)
def test_sound_ones_pass_all(given, benchmark):
    report = check(given, benchmark, motion=burst(2.0))
    assert report.passed, report.verdict
    assert [finding.name for finding in report.findings] == NAMES
    assert (report["gradient"].passed is None) == (given == "passthrough")
    assert report["lost"].value == 0 and 0 < report["volts"].value < 3.8
    assert 0.99 < report["radius"].value < 1 and report["margin"].value > 1


@pytest.fixture(scope="module")
def small(benchmark):
    """The stand of an ADFC whose line is short, so that it is renewed several times."""
    return run.make_stand(ADFC(nb=48, no=40), benchmark, burst(), 3)


def test_it_is_driven_as_the_compensator_goes(small):
    """Window by window and with the box's own ring, two ways to serve a delay line."""
    box = Compensator.of(small.made, small.benchmark)
    x_a, x_m = small.strokes

    def sample(state, seen):
        state, u, _ = box.step(state, *seen)
        return state, u

    u = jax.jit(lambda *seen: jax.lax.scan(sample, box.init(64), seen)[1])(x_a, x_m)
    assert small.samples == len(u) == 22 * 48 + 22 * (box.controller.delay_line(1).samples - 48)
    assert stand.apart(small.u, np.asarray(u)) < 1e-9
    assert not np.array_equal(small.u[600:], x_a[600:])  # its fits are used by then


def test_strokes_are_those_of_the_plants(benchmark):
    """Against z(k+1) = A z(k) + B u(k), x = C z, in a loop of NumPy's."""
    plants, quiet = draw_plants(3, seed=4), SensorNoise(noise_power=0.0)
    x_a = strokes.targets(60, 3, benchmark.dt, seed=2)
    x_m = strokes.measured(benchmark, plants, x_a, quiet)
    assert np.all(x_a[0] == 0) and np.std(x_a[-1]) > 0.01
    for trial in range(3):
        plant = jax.tree.map(lambda x, i=trial: x[..., i : i + 1], plants.discretise(benchmark.dt))
        A, B, C, _ = to_dense(plant)
        z = np.zeros(len(A))
        for k, u in enumerate(x_a[..., trial]):
            np.testing.assert_allclose(x_m[k, :, trial], C @ z, rtol=1e-9, atol=1e-12)
            z = A @ z + B @ u


def test_bits_and_distances():
    one = np.array([0.0, 1.0, np.nan])
    assert stand.same(one, one.copy()).all()
    assert not stand.same(one[:1], np.array([-0.0])).any()
    assert stand.apart(one, one.copy()) == 0
    assert stand.apart(np.array([4.0, 1.0]), np.array([4.0, 2.0])) == 0.25
    assert stand.apart(one, np.zeros(3)) == np.inf


FINDINGS = (
    Finding("a", True, float("inf"), "Holds.", "ms"),
    Finding("b", False, 2.0, "Change it."),
    Finding("c", None, None, "Left out."),
)


def test_a_report_in_words_and_as_json():
    report = Report("mine", 1, "burst", False, FINDINGS)
    assert not report.passed and report.failed == FINDINGS[1:2] and report["c"] is FINDINGS[2]
    assert report.verdict == "mine: 1 of 3 checks failed (b), 1 not judged."
    assert (
        Report("mine", 1, "burst", False, FINDINGS[:1]).verdict == "mine: none of 1 check failed."
    )
    found = json.loads(json.dumps(report.as_dict(), allow_nan=False))
    assert [f["value"] for f in found["findings"]] == ["inf", 2.0, None]
    assert [f["passed"] for f in found["findings"]] == [True, False, None]
    assert [row[1:3] for row in report.table().rows] == [
        ("passed", "inf ms"), ("FAILED", "2"), ("not judged", "–"),
    ]  # fmt: skip


def test_arguments_that_cannot_be_used(benchmark):
    with pytest.raises(InputError, match="`benchmark` must be a Benchmark"):
        check("lqg", 1024)
    with pytest.raises(InputError, match="`seed` must"):
        check("lqg", benchmark, seed=-1)
    with pytest.raises(InputError, match="`motion` must be sampled at the benchmark's 1024 Hz"):
        check("lqg", benchmark, motion=burst(fs=512))
    with pytest.raises(InputError, match=r"Controller 'adfx' is unknown; the nearest are adfc"):
        check("adfx", benchmark)


def test_the_page_lists_the_checks():
    page = (Path(__file__).parents[2] / "docs" / "controllers.md").read_text("utf-8")
    section = page.partition("## Check yours")[2].partition("\n## ")[0]
    table = section.partition("| check | what is asked |")[2]
    assert re.findall(r"^\| `([^`]+)` \|", table, re.MULTILINE) == NAMES
    words = r"^([a-z]+(?: [a-z]+)?) {2,}(?:passed|FAILED|not judged) "
    shown = re.findall(words, section, re.MULTILINE)
    assert shown == NAMES


def told(*words):
    """Exit code and output of the command."""
    result = CliRunner().invoke(app, ["check-controller", *words], terminal_width=200)
    return result.exit_code, result.stdout


def test_the_command_fails_with_a_controller():
    code, text = told(f"{broken.__file__}:Mixing", "--quick")
    assert code == 1
    words = " ".join(text.split())
    assert "sound: 1 of 14 checks failed (trials)" in words and "FAILED" in words


def test_the_command_writes_json():
    code, text = told("passthrough", "--quick", "--json", "--seed", "7")
    found = json.loads(text)
    assert code == 0 and found["passed"] and found["seed"] == 7 and found["quick"]
    assert [finding["name"] for finding in found["findings"]] == NAMES
