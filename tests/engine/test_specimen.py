"""The slot of the specimen: what it sees, and what a linear one answers."""

from dataclasses import dataclass, replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from martths_jax import (
    IdealPlants,
    InputError,
    Passthrough,
    SensorNoise,
    build_benchmark,
    simulate,
)
from martths_jax.motions import Motion
from martths_jax.reference import reference_response
from martths_jax.rig.specimen import History, LinearSpecimen, Specimen
from martths_jax.structure.modal import to_dense
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


def in_the_loop(benchmark, **changes):
    """The benchmark with its specimen as one that has a state, so that it stands in the loop."""
    own = Remembering(benchmark.specimen, jnp.asarray(2.0), jnp.asarray(0.0))
    return replace(benchmark, specimen=replace(own, **changes))


@pytest.mark.parametrize("integrator", ["newmark", "zoh"])
def test_the_reference_with_the_specimen_in_the_loop_solves_its_equations(integrator):
    """Sample by sample with dense matrices: what comes out is what the equations say."""
    benchmark = in_the_loop(build_benchmark(integrator=integrator), stiffness=jnp.asarray(3e5))
    ground = burst(1.0).acceleration
    response = np.asarray(reference_response(benchmark, jnp.asarray(ground)))
    A, B, C, D = to_dense(benchmark.numerical)
    taps, x, state = np.asarray(benchmark.specimen.linear.taps), np.zeros(len(A)), 0.0
    before = [response[0, :2], response[0, :2]]
    for k, a in enumerate(ground):
        q = response[k, :2]
        state = (state + DT * q[0]) / (1 + DT * 2.0)
        force = taps[0] @ q + taps[1] @ before[0] + taps[2] @ before[1]
        force[0] += 3e5 * state
        load = np.array([a, *-force])
        left = C @ x + D @ load - response[k]
        assert np.abs(left).max() <= 1e-9 * np.abs(response).max()
        x, before = A @ x + B @ load, [q, before[0]]


def test_a_linear_specimen_in_the_loop_meets_the_reference_as_dt_shrinks():
    """Consistent partition: all but the rotational masses, which the reference does not have."""
    errors = []
    for fs in (1024.0, 4096.0):
        linear = build_benchmark(fs, partition="consistent")
        ground = jnp.asarray(burst(2.0, fs).acceleration)
        one, other = (
            np.asarray(reference_response(b, ground)) for b in (linear, in_the_loop(linear))
        )
        errors.append(np.linalg.norm(one - other) / np.linalg.norm(one))
    assert errors[1] < 1.5e-4 and errors[0] < 1e-3


def test_the_hybrid_loop_meets_the_reference_with_its_specimen():
    """Ideal actuators and no noise: what is left is their one sample, of first order in dt."""
    errors = []
    for fs in (2048.0, 4096.0):
        benchmark = in_the_loop(
            build_benchmark(fs, partition="consistent", force_from="measurement"),
            stiffness=jnp.asarray(3e5),
        )
        t = np.arange(round(fs)) / fs
        ground = np.sin(2 * np.pi * 2 * t) ** 3 * np.minimum(1, 4 * t) ** 3
        run = simulate(
            benchmark, Passthrough(), IdealPlants(np.zeros(1, int)), Motion("sine", ground, fs),
            SensorNoise(0.0), keep=True,
        )  # fmt: skip
        reference = np.asarray(run.reference)
        apart = np.abs(run.signals["num"][0] - reference).max(0)
        errors.append(apart / np.abs(reference).max(0))
    np.testing.assert_allclose(np.log2(errors[0] / errors[1]), 1.0, atol=0.2)
    assert np.all(errors[1] < 1e-2)


def test_the_work_on_a_specimen_is_stored_or_dissipated():
    """f = K q + C v: the work over a path is K q^2 / 2 at its end and the integral of C v^2."""
    fs, K, C = 8192.0, 4e5, 3e3
    specimen = LinearSpecimen.of(*(np.array([[x]]) for x in (0.0, C, K)), 1 / fs)
    t = np.arange(int(2 * fs)) / fs
    q = 1e-3 * np.sin(2 * np.pi * 1.7 * t) * t
    force = [float(specimen.step((), one, 1 / fs)[1][0, 0]) for one in histories(q[:, None])]
    work = np.sum((np.array(force)[1:] + force[:-1]) / 2 * np.diff(q))
    lost = np.sum(C * np.diff(q) ** 2 * fs)
    np.testing.assert_allclose(work, K * q[-1] ** 2 / 2 + lost, rtol=2e-3)


def test_a_specimen_without_a_solution_is_refused():
    """A force that no motion answers to: the sample and what is left stand in the sentence."""

    @jax.tree_util.register_dataclass
    @dataclass(frozen=True)
    class Broken(Specimen):
        linear: LinearSpecimen

        def step(self, state, history, dt):
            _, force = self.linear.step((), history, dt)
            return state, force * jnp.where(jnp.abs(history.now[0, 0]) > 1e-5, jnp.nan, 1.0)

    benchmark = build_benchmark()
    broken = replace(benchmark, specimen=Broken(benchmark.specimen))
    with pytest.raises(InputError, match=r"specimen Broken cannot be found: at sample \d+"):
        reference_response(broken, jnp.asarray(burst(1.0).acceleration))
