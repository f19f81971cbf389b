"""A controller with a fault fails the check that is about it, and no other."""

import re
from dataclasses import replace

import jax
import pytest

from martths_jax.conformity import check, run
from tests.conformity import broken
from tests.engine.motions import burst

#: class -> check that fails, what its sentence says.
FAULTS = {
    "Growing": ("structure", "Incompatible shapes"),
    "Counting": ("structure", "keep the type of its state, but got int64 from init and float64"),
    "Listed": ("structure", "field `taps` of Listed must be hashable, but got list; make it a tup"),
    "Listing": ("outside state", "a value of an earlier trace.* keep all that it remembers in the"),
    "Clocked": ("outside state", "other commands when `step` is called again; keep all that"),
    "CallingBack": ("outside state", "other commands after a run of other trials; keep all that"),
    "Marking": ("outside state", r"Running it changes `has_run` of self \(Marking\); keep all"),
    "Fresh": ("one trace", "two preparations differ in `shape`; let what is static be numbers"),
    "Weak": ("one trace", r"its state .* begins as ~float64\[\] and goes on as float64\[\]; let"),
    "Peeking": ("causal", "sample 614 changes with x_a after sample 614; let `step` use nothing"),
    "Mixing": ("trials", "in another order and in a smaller batch and alone; let `step` and"),
    "Spreading": ("nan", "Trial 5 turns NaN and changes 63 other trials; let `step` and"),
    "Asking": ("jit", r"differ by 0\.\d+ of the largest in 4 samples.* no isinstance\(x, Tracer\)"),
    "Traced": ("jit", r"`step` ends in ValueError \(no trace, no command\); let it work on"),
    "Rooted": ("gradient", "The gradient in gain is not finite; .* jnp.where"),
    "Untraceable": ("gradient", "cannot be made of traced gain: ConcretizationTypeError"),
}
#: The same for those that the loop has to be run for.
LOOP_FAULTS = {
    "Foreseeing": (["causal loop"], "Signal u of sample 430 changes .* after sample 430; let `st"),
    "Loud": (["volts"], r"asks actuator \d in trial \d+ for more than the 3.8 V .*; lower its"),
    "Runaway": (["lost", "radius", "margin"], "Trial 1 diverged: .*; bound what adapts"),
}


@pytest.fixture
def untimed(monkeypatch):
    """Without the one check that nothing fails, and without the strict rules of these tests."""
    monkeypatch.setattr(run, "CHECKS", tuple(c for c in run.CHECKS if c.names != ("cost",)))
    with jax.numpy_rank_promotion("allow"), jax.numpy_dtype_promotion("standard"):
        yield


@pytest.mark.usefixtures("untimed")
@pytest.mark.parametrize("kind", FAULTS)
def test_a_fault_fails_its_check_and_no_other(kind, benchmark):
    name, sentence = FAULTS[kind]
    report = check(getattr(broken, kind)(), benchmark, quick=True)
    assert [finding.name for finding in report.failed] == [name]
    assert re.search(sentence, report[name].sentence), report[name].sentence
    assert "\n" not in report[name].sentence


@pytest.mark.slow
@pytest.mark.usefixtures("untimed")
@pytest.mark.parametrize("kind", LOOP_FAULTS)
def test_a_fault_in_the_loop(kind, benchmark):
    names, sentence = LOOP_FAULTS[kind]
    report = check(getattr(broken, kind)(), benchmark, motion=burst())
    assert [finding.name for finding in report.failed] == names
    assert re.search(sentence, report[names[0]].sentence), report[names[0]].sentence


@pytest.mark.usefixtures("untimed")
def test_what_a_fault_makes_meaningless_is_not_judged(benchmark):
    report = check(broken.Growing(), benchmark)
    rest = [finding for finding in report.findings if finding.name != "structure"]
    assert {finding.passed for finding in rest} == {None}
    assert all("until `structure` passes" in finding.sentence for finding in rest)


def test_a_check_that_breaks_is_a_finding(benchmark, monkeypatch):
    def stop(stand):
        raise ZeroDivisionError("of one's own\nand more")

    last = replace(run.CHECKS[0], names=("a", "b"), run=stop)
    monkeypatch.setattr(run, "CHECKS", (last,))
    report = check(broken.Sound(), benchmark)
    assert [f.sentence for f in report.failed] == [
        "It ends in ZeroDivisionError (of one's own)."
    ] * 2
