"""The slot of the specimen: what it sees, and what a linear one answers."""

from dataclasses import dataclass, replace

import jax
import jax.numpy as jnp
import numpy as np

from martths_jax import IdealPlants, Passthrough, SensorNoise, build_benchmark, simulate
from martths_jax.rig.specimen import History, LinearSpecimen, Specimen
from tests.engine.motions import burst

DT = 1 / 1024


def histories(q):
    """What a specimen sees of a motion (N, d), sample by sample."""
    before = jnp.stack([q[0], q[0]])[..., None]
    for row in q:
        one = History(row[:, None], before)
        yield one
        before = one.moved()


def test_differences_are_exact_on_a_parabola():
    """Backward differences of q = c t^2 / 2: the acceleration is c, the velocity c (t - dt/2)."""
    t = np.arange(6) * DT
    seen = list(histories(jnp.asarray(3.0 * t**2 / 2)[:, None]))
    assert float(seen[0].velocity(DT)[0, 0]) == 0.0 == float(seen[0].acceleration(DT)[0, 0])
    for k in range(2, 6):
        np.testing.assert_allclose(seen[k].velocity(DT)[0, 0], 3.0 * (t[k] - DT / 2), rtol=1e-9)
        np.testing.assert_allclose(seen[k].acceleration(DT)[0, 0], 3.0, rtol=1e-9)


def test_a_linear_specimen_is_its_matrices():
    rng = np.random.default_rng(0)
    M, C, K = rng.normal(size=(3, 2, 3))
    specimen = LinearSpecimen.of(M, C, K, DT)
    state = specimen.init(1)
    for one in histories(jnp.asarray(rng.normal(size=(7, 3)) * 1e-3)):
        state, force = specimen.step(state, one, DT)
        expected = K @ one.now + C @ one.velocity(DT) + M @ one.acceleration(DT)
        np.testing.assert_allclose(force, expected, rtol=1e-9)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Remembering(Specimen):
    """The linear one, plus a dashpot that has its own state: s' = -a s + q, force b s on x."""

    linear: LinearSpecimen
    rate: jax.Array
    stiffness: jax.Array

    def init(self, trials):
        return jnp.zeros(trials)

    def step(self, state, history, dt):
        _, force = self.linear.step((), history, dt)
        state = (state + dt * history.now[0]) / (1 + dt * self.rate)
        return state, force.at[0].add(self.stiffness * state)


def test_a_specimen_with_a_state_runs_in_the_loop():
    """Without its spring it gives the linear one's bits; the force is that of its own recursion."""
    benchmark = build_benchmark(force_from="measurement")
    plants, quiet = IdealPlants(np.arange(2)), SensorNoise(0.0)
    own = lambda k: replace(  # noqa: E731
        benchmark, specimen=Remembering(benchmark.specimen, jnp.asarray(2.0), jnp.asarray(k))
    )
    runs = [
        simulate(b, Passthrough(), plants, burst(1.0), quiet, keep=True).signals
        for b in (benchmark, own(0.0), own(3e6))
    ]
    np.testing.assert_array_equal(runs[0]["force"], runs[1]["force"])
    motion, state = np.asarray(runs[2]["est"])[0], 0.0
    alone = np.asarray(benchmark.specimen.taps)
    before = [motion[0], motion[0]]
    for k, q in enumerate(motion):
        state = (state + DT * q[0]) / (1 + DT * 2.0)
        expected = alone[0] @ q + alone[1] @ before[0] + alone[2] @ before[1]
        expected[0] += 3e6 * state
        np.testing.assert_allclose(runs[2]["force"][0, k], expected, rtol=1e-7, atol=1e-6)
        before = [q, before[0]]
    assert np.abs(runs[2]["num"] - runs[0]["num"]).max() > 1e-5
