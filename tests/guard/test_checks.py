"""Everything a user can hand to `simulate` is checked before anything runs."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from martths_jax import (
    ADFC,
    LQG,
    InputError,
    Motion,
    Passthrough,
    Plants,
    nominal_plant,
    simulate,
)
from tests.engine.motions import burst

MOTION = burst(0.3)
#: A controller whose numbers are arrays is not checked when it is made, but when it is used.
LATER = partial(ADFC, no=np.array(1023))


def test_a_controller_of_plain_numbers_is_checked_when_made():
    with pytest.raises(InputError, match=r"(?s)cannot be used \(2 problems\).*`pull`.*`anchor`"):
        ADFC(pull=-1.0, anchor=np.zeros(3))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"benchmark": None}, r"`benchmark` must be a Benchmark, but got NoneType. Use build_"),
        ({"controller": ADFC}, r"but got the class ADFC. Call it: ADFC\(...\)."),
        ({"controller": []}, "one for each of the 1 trials, but got 0"),
        ({"controller": [LQG]}, "`controller` must be a Controller or a sequence of them"),
        ({"controller": ADFC(q=np.array(-1.0))}, "`q` must be positive"),
        ({"controller": LATER(anchor=np.zeros((2, 8)))}, r"`anchor` must be \(8, 2\), but got sh"),
        ({"controller": LATER(start=np.full((8, 2), np.inf))}, "`start` must be finite"),
        ({"plants": None}, "`plants` must be a batch of plants, but got NoneType"),
        ({"plants": Plants}, "but got the class Plants"),
        ({"plants": nominal_plant()[:0]}, "`plants` must hold at least one trial"),
        (
            {"plants": Plants(np.zeros((2, 9)), np.arange(3))},
            r"one trial number for each of the 2 plants, but got shape \(3,\)",
        ),
        (
            {"plants": Plants(np.full((2, 9), np.nan), np.arange(2))},
            "finite zeros and poles, but got NaN or infinity in row 0",
        ),
        ({"motion": "elcentro"}, r"`motion` must be a Motion, but got str. Use load_motion"),
        ({"motion": Motion("x", np.array(["a", "b"]), 1024.0)}, "hold real numbers"),
        ({"motion": Motion("x", np.array([1.0]), 1024.0)}, r"N >= 2, but got \(1,\)"),
        ({"noise": "quiet"}, r"`noise` must be a SensorNoise or an array \(307, 2\)"),
        ({"noise": np.zeros((307, 2), dtype=complex)}, "`noise` must hold real numbers"),
        ({"noise": np.zeros((307, 3))}, r"but got shape \(307, 3\)"),
        ({"keep": "yes"}, "`keep` must be True or False, but got 'yes'"),
        ({"progress": 3}, "`progress` must be callable, but got int"),
    ],
)
def test_one_problem(benchmark, change, message):
    given = {
        "benchmark": benchmark,
        "controller": Passthrough(),
        "plants": nominal_plant(),
        "motion": MOTION,
    }
    with pytest.raises(InputError, match=message):
        simulate(**(given | change))


def test_all_problems_are_listed_at_once(benchmark):
    """One for each argument; what depends on a broken argument is not held against the rest."""
    with pytest.raises(InputError) as caught:
        simulate(
            None,
            [ADFC(q=np.array(-1.0), anchor=np.zeros(3)), "lqg"],
            np.zeros(9),
            replace(MOTION, acceleration=np.zeros((2, 2))),
            np.zeros((5, 3)),
            keep=1,
            progress="bar",
        )
    lines = str(caught.value).splitlines()
    assert lines[0] == "The simulation cannot run (7 problems):"
    names = ("benchmark", "plants", "motion", "noise", "controller", "keep", "progress")
    for number, (name, line) in enumerate(zip(names, lines[1:], strict=True), 1):
        assert line.startswith(f"  {number}. Argument `{name}` must ")


def test_problems_of_a_controller_are_all_listed(benchmark):
    wrong = ADFC(q=np.array(-1.0), pull=np.array(np.nan), anchor=np.zeros(3))
    with pytest.raises(InputError, match=r"(?s)3 problems.*`pull`.*`q`.*`anchor`"):
        simulate(benchmark, [wrong, wrong], nominal_plant()[[0, 0]], MOTION)


def test_signals_that_would_not_fit_into_memory(benchmark):
    many = Plants(np.zeros((10**6, 9)), np.arange(10**6))
    with pytest.raises(InputError, match=r"`keep` must fit into .* GiB, but got 1000000 trials of"):
        simulate(benchmark, Passthrough(), many, replace(MOTION, acceleration=np.zeros(10**5)),
                 keep=True)  # fmt: skip
