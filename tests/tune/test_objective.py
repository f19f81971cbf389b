"""Objectives: what is understood, what is refused, and how near the smooth peaks are."""

import jax.numpy as jnp
import numpy as np
import pytest

from martths_jax import InputError
from martths_jax.indices import KNOWN, Norm
from martths_jax.indices.norm import POWER
from martths_jax.tune import Objective, Options
from martths_jax.tune.gradient import segment_length


def test_a_group_is_the_mean_of_its_indices():
    terms = Objective.parse("j2 + 0.5*J8_26").terms
    assert terms == ((0.5, "J2_1"), (0.5, "J2_2"), (0.5, "J8_26"))


def test_any_index_of_the_table_can_be_tuned_for():
    objective = Objective.parse("j2TRUE + 0.5*TI_1")
    assert objective.names == ("J2true_1", "J2true_2", "TI_1")
    assert [o.quantities for o in objective.observers(1024.0)[:-1]] == [("",), ("last", "rms")]


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"objective": "j2+j11"}, "'j11'"),
        ({"objective": "-1*j2"}, "positive weight on J2"),
        ({"objective": ""}, "weighted indices"),
        ({"start": (("e1", -1.0),)}, "positive e1"),
        ({"start": (("lambda", 1.0),)}, "'lambda'"),
        ({"trials": 0}, "trials"),
        ({"method": "newton"}, "method"),
        ({"mode": "sideways"}, "mode"),
        ({"controller": "pid"}, "'pid'"),
        ({"free": ("e3",)}, "e3"),
        ({"rate": 0.0}, "rate"),
        ({"volts": -1.0}, "volts"),
    ],
)
def test_bad_options_are_one_sentence(changes, words):
    options = Options(**({"controller": "lqg", "objective": "j2"} | changes))
    with pytest.raises(InputError, match=words):
        options.check()


def test_peaks_stand_in_by_the_p_norm_over_valid_samples():
    rng = np.random.default_rng(0)
    signals = {
        "x_a": rng.normal(size=(50, 2, 1)),
        "x_m": rng.normal(size=(50, 2, 1)),
        "num": rng.normal(size=(50, 6, 1)),
        "est": rng.normal(size=(50, 2, 1)),
    }
    reference = rng.normal(size=(50, 6, 1))
    objective = Objective.parse("j3 + J10_27")
    assert {index.kind for index in objective.smooth} == {KNOWN["J3_1"].kind.smooth()} == {Norm()}
    norm, _ = objective.observers(1024.0)
    sums = norm.init(1)
    for k in range(50):
        now = {name: jnp.asarray(x[k]) for name, x in signals.items()}
        sums = norm.add(sums, now, jnp.asarray(reference[k]), jnp.asarray(k), k < 40)
    value, missing = norm.result(norm.finish(sums))[""]
    assert not np.any(missing)
    x_a, x_m, num = (signals[name][:40, :, 0] for name in ("x_a", "x_m", "num"))
    target = reference[:40, 5, 0]
    for row, (y, x) in enumerate(((x_m[:, 0], x_a[:, 0]), (x_m[:, 1], x_a[:, 1]),
                                  (num[:, 5], target))):  # fmt: skip
        exact = 100 * np.linalg.norm(y - x, POWER) / np.linalg.norm(x, POWER)
        assert float(value[row, 0]) == pytest.approx(exact, rel=1e-12)


def test_segments_divide_the_window_and_grow_like_the_root():
    assert segment_length(42_000, 1024) == 128
    assert segment_length(2_000_000, 1024) == 1024
    assert segment_length(42_000, 1000) == 200
    assert segment_length(42_000, 1021) == 1
