"""Controllers with one value a trial: any number of trials, blocks and devices, and under jit."""

from dataclasses import replace

import jax
import numpy as np
import pytest

from martths_jax import ADFC, LQG, draw_plants, indices, simulate
from martths_jax.indices import NAMES, delay
from martths_jax.simulation import LANES
from tests.engine.motions import burst

MOTION, NB = burst(0.4), 64


def adfc(**given):
    return ADFC(nb=NB, **({"no": NB - 1, "towards": "inverse"} | given))


def adfc_pair(benchmark, trials):
    """A controller with every documented array over the trials, and the one of a given trial."""
    rng = np.random.default_rng(0)
    no = rng.integers(0, NB, trials)
    pull, q = 10.0 ** rng.uniform(-5, -3, trials), 10.0 ** rng.uniform(-5, -4, trials)
    start, anchor = np.zeros((2, 8, 2, trials))
    start[0, 0] = start[4, 1] = rng.uniform(0.8, 1.0, trials)
    anchor[0, 0] = anchor[4, 1] = rng.uniform(0.9, 1.1, trials)
    given = {"no": no, "pull": pull, "q": q, "start": start, "anchor": anchor}
    return adfc(**given), lambda i: adfc(
        no=int(no[i]), pull=float(pull[i]), q=float(q[i]), start=start[..., i],
        anchor=anchor[..., i],
    )  # fmt: skip


def lqg_pair(benchmark, trials):
    start = LQG.design(benchmark)
    scale = np.linspace(0.9, 1.05, trials)
    gain = np.asarray(start.estimator.filter_gain)
    several = replace(
        start,
        K_z=np.asarray(start.K_z)[..., None] * scale,
        K_e=np.asarray(start.K_e)[..., None] * scale,
        estimator=replace(start.estimator, filter_gain=gain[..., None] * scale),
    )
    return several, lambda i: replace(
        start,
        K_z=start.K_z * scale[i],
        K_e=start.K_e * scale[i],
        estimator=replace(start.estimator, filter_gain=gain * scale[i]),
    )


@pytest.mark.slow
@pytest.mark.parametrize("pair", [adfc_pair, lqg_pair])
def test_every_documented_array_over_the_trials(benchmark, monkeypatch, pair):
    """More trials than a device's block holds, so that the last block is hardly filled."""
    trials = LANES + 6
    monkeypatch.setattr(delay, "RANGES", ((32, 96),) * 3)  # one program
    several, alone = pair(benchmark, trials)
    plants = draw_plants(trials, 4)
    together = indices(simulate(benchmark, several, plants, MOTION))
    chosen = [0, trials - 1]
    single = indices(simulate(benchmark, [alone(i) for i in chosen], plants[chosen], MOTION))
    for name in NAMES:
        np.testing.assert_allclose(together[name][chosen], single[name], rtol=1e-8, err_msg=name)
    assert np.ptp(together["J2_1"]) > 0


def test_under_jit(benchmark):
    plants = draw_plants(3, 4)
    pull = np.array([1e-4, 3e-4, 1e-3])
    run = lambda pull: indices(simulate(benchmark, adfc(pull=pull), plants, MOTION))  # noqa: E731
    traced, by_blocks = jax.jit(run)(pull), run(pull)
    for name in NAMES:
        np.testing.assert_allclose(traced[name], by_blocks[name], rtol=1e-6, err_msg=name)
