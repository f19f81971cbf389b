"""The hybrid loop: consistency with the reference, gradients, refusals."""

from dataclasses import dataclass, replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import martths_jax
from martths_jax import (
    ADFC,
    LQG,
    Decision,
    IdealPlants,
    InputError,
    Motion,
    Passthrough,
    SensorNoise,
    Status,
    build_benchmark,
    draw_plants,
    indices,
    nominal_plant,
    simulate,
)
from martths_jax.control.estimators import DirectMeasurement
from martths_jax.indices import NAMES, PAIRS
from tests.engine.motions import burst

QUIET = SensorNoise(noise_power=0.0)


def test_indices_are_those_of_the_kept_signals(benchmark):
    """Running sums against NumPy on whole histories, for a length that fills no window."""
    motion = burst()
    result = simulate(benchmark, LQG.design(benchmark), draw_plants(3, 1), motion, keep=True)
    found = indices(result)
    s, ref = result.signals, np.broadcast_to(result.reference, (3, *result.reference.shape))
    values = np.concatenate([s["x_m"], s["est"], s["est"], s["num"][..., 2:]], axis=-1)
    targets = np.concatenate([s["x_a"], s["num"][..., :2], ref], axis=-1)
    error = values - targets
    rms = 100 * np.sqrt(np.sum(error**2, 1) / np.sum(targets**2, 1))
    peak = 100 * np.max(np.abs(error), 1) / np.max(np.abs(targets), 1)
    for i, (rms_name, peak_name) in enumerate(PAIRS):
        np.testing.assert_allclose(found[rms_name], rms[:, i], rtol=1e-9)
        np.testing.assert_allclose(found[peak_name], peak[:, i], rtol=1e-9)
    for name, signal in (("J1", "x_m"), ("J4", "x_hat")):
        for i in range(2):
            for trial in range(3):
                x, y = s["x_a"][trial, :, i], s[signal][trial, :, i]
                lag = np.argmax(np.correlate(y, x, "full")) - (x.size - 1)
                assert found[f"{name}_{i + 1}"][trial] == lag / 1.024
    assert list(found) == list(NAMES)


def test_interpolated_delay_lies_within_half_a_sample(benchmark):
    result = simulate(benchmark, LQG.design(benchmark), nominal_plant(), burst())
    whole, fine = indices(result), indices(result, interpolate=True)
    for name in ("J1_1", "J1_2", "J4_1", "J4_2"):
        assert 0 < abs(whole[name][0] - fine[name][0]) <= 0.5 / 1.024
    assert whole["J2_1"] == fine["J2_1"]


def test_a_delay_far_outside_the_first_range_is_found(benchmark):
    found = indices(simulate(benchmark, Passthrough(), nominal_plant(), burst(), QUIET))
    assert found["J1_1"][0] > 20


@pytest.mark.slow
@pytest.mark.usefixtures("optimised")
def test_consistent_hybrid_loop_meets_the_reference_at_first_order():
    """Same frame out and in, ideal actuators, no noise: the error is that of one sample's delay."""
    errors = []
    for fs in (1024, 2048, 4096):
        benchmark = build_benchmark(fs, partition="consistent")
        t = np.arange(round(1.0 * fs)) / fs
        ground = np.sin(2 * np.pi * 2 * t) ** 3 * np.minimum(1, 4 * t) ** 3
        result = simulate(
            benchmark, Passthrough(), IdealPlants(jnp.arange(1)), Motion("sine", ground, float(fs)),
            QUIET, keep=True,
        )  # fmt: skip
        num = result.signals["num"][0]
        errors.append(np.abs(num - result.reference).max(0) / np.abs(result.reference).max(0))
    orders = np.log2(np.array(errors[:-1]) / np.array(errors[1:]))
    np.testing.assert_allclose(orders, 1.0, atol=0.2)
    assert np.all(errors[-1] < 5e-3)


def test_published_partition_does_not_meet_the_reference():
    """It takes another frame out than it puts in, so even a perfect transfer keeps an error."""
    benchmark = build_benchmark(4096)
    t = np.arange(4096) / 4096
    motion = Motion("sine", np.sin(2 * np.pi * 2 * t) ** 3, 4096.0)
    result = simulate(benchmark, Passthrough(), IdealPlants(jnp.arange(1)), motion, QUIET)
    assert indices(result)["J7_4"][0] > 3


@pytest.mark.usefixtures("optimised")
def test_trial_alone_has_the_bits_it_has_in_a_batch(benchmark):
    motion, plants = burst(), draw_plants(5, 4)
    for controller in (LQG.design(benchmark), ADFC(nb=128, no=127)):
        batch = indices(simulate(benchmark, controller, plants, motion))
        alone = indices(simulate(benchmark, controller, plants[3], motion))
        for name in NAMES:
            assert batch[name][3] == alone[name][0]


def test_one_controller_a_trial(benchmark):
    motion, plants = burst(), draw_plants(3, 4)
    several = [
        ADFC(nb=128, no=no, pull=pull) for no, pull in ((127, 1e-5), (64, 1e-5), (127, 1e-3))
    ]
    together = indices(simulate(benchmark, several, plants, motion))
    for i, controller in enumerate(several):
        alone = indices(simulate(benchmark, controller, plants[i], motion))
        for name in NAMES:
            assert together[name][i] == pytest.approx(alone[name][0], rel=1e-6)


def test_shared_and_given_noise(benchmark):
    """A model's noise, drawn by hand and handed in as an array, gives the same trial."""
    motion, plants, model = burst(), draw_plants(2, 4), SensorNoise(seed=9, shared=False)
    drawn = np.moveaxis(
        np.asarray(model.draw(plants.trial, motion.acceleration.size, 1024.0)), -1, 0
    )
    by_model = simulate(benchmark, Passthrough(), plants, motion, model, keep=True)
    by_hand = simulate(benchmark, Passthrough(), plants, motion, drawn, keep=True)
    np.testing.assert_array_equal(by_model.signals["x_m"], by_hand.signals["x_m"])
    one = simulate(benchmark, Passthrough(), plants, motion, drawn[0], keep=True)
    np.testing.assert_array_equal(one.signals["x_m"][0], by_hand.signals["x_m"][0])


def test_noise_has_its_power_and_does_not_depend_on_length():
    model = SensorNoise(noise_power=1.5e-7, seed=3)
    long = np.asarray(model.draw(jnp.arange(20), 5000, 1024.0))
    np.testing.assert_array_equal(long[:700], model.draw(jnp.arange(20), 700, 1024.0))
    assert long.shape == (5000, 1, 20)
    assert np.var(long) == pytest.approx(1.536e-4, rel=0.02)
    pair = np.asarray(SensorNoise(shared=False).draw(jnp.arange(1), 5000, 1024.0))
    assert abs(np.corrcoef(pair[:, 0, 0], pair[:, 1, 0])[0, 1]) < 0.05


@pytest.mark.slow
def test_gradients_with_respect_to_controller_gains(benchmark):
    motion, plants = burst(0.3), draw_plants(2, 1)
    start = LQG.design(benchmark)

    def costs(scales):
        controller = replace(start, K_z=start.K_z * scales[0], K_e=start.K_e * scales[1])
        found = indices(simulate(benchmark, controller, plants, motion))
        return jnp.stack([jnp.mean(found[name]) for name in ("J2_1", "J5_28", "J7_4")])

    gradient = jax.jit(jax.jacrev(costs))(jnp.ones(2))
    value, h = jax.jit(costs), 1e-5
    differences = np.stack(
        [(value(jnp.ones(2) + d) - value(jnp.ones(2) - d)) / (2 * h) for d in h * np.eye(2)], axis=1
    )
    np.testing.assert_allclose(gradient, differences, rtol=1e-5)
    assert np.all(np.abs(gradient[:, 0]) > 1e-3)


@pytest.mark.slow
def test_gradient_with_respect_to_the_pull(benchmark):
    motion, plants = burst(0.3), nominal_plant()

    @jax.jit
    def cost(log_pull):
        controller = ADFC(nb=64, no=63, pull=jnp.exp(log_pull))
        return indices(simulate(benchmark, controller, plants, motion))["J2_1"][0]

    x, h = np.log(1e-4), 1e-4
    gradient = float(jax.jit(jax.grad(cost))(x))
    difference = float(cost(x + h) - cost(x - h)) / (2 * h)
    assert gradient == pytest.approx(difference, rel=1e-4)
    assert abs(gradient) > 1e-6


def test_statuses(benchmark):
    """A loop that runs away, beside one that does not."""
    motion = burst()
    start = LQG.design(benchmark)
    wild = replace(start, K_z=-20 * start.K_z)
    hot = replace(motion, acceleration=motion.acceleration * 15)
    result = simulate(benchmark, [start, wild, start], draw_plants(3, 1), motion)
    assert result.status.tolist() == [Status.OK, Status.DIVERGED, Status.OK]
    found = indices(result)
    assert np.isnan(found["J2_1"]).tolist() == [False, True, False]
    alone = indices(simulate(benchmark, [start] * 3, draw_plants(3, 1), motion))
    assert found["J2_1"][0] == pytest.approx(alone["J2_1"][0], rel=1e-12)
    strong = simulate(benchmark, start, nominal_plant(), hot)
    assert strong.status[0] == Status.SATURATED
    assert np.max(strong.watch.volt_peak) > 3.8


def test_describing_a_result(benchmark):
    result = simulate(benchmark, Passthrough(), nominal_plant(), burst(0.3))
    assert str(result) == "passthrough on burst: 1 trial at 1024 Hz, 307 samples; 1 ok"


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"motion": np.zeros(10)}, "`motion` must be a Motion, but got ndarray"),
        ({"motion": burst(0.3, fs=512)}, "sampled at the benchmark's 1024 Hz, but got 512 Hz"),
        (
            {"motion": Motion("x", np.array([0, np.nan, 0]), 1024.0)},
            "finite, but got nan at sample 1",
        ),
        ({"motion": Motion("x", np.zeros((3, 2)), 1024.0)}, r"have \(N,\) samples"),
        ({"noise": np.zeros((10, 2))}, r"`noise` must be a SensorNoise or an array \(307, 2\)"),
        ({"noise": np.zeros((2, 307, 2))}, r"but got shape \(2, 307, 2\)"),
        ({"noise": np.full((307, 2), np.inf)}, "`noise` must be finite"),
        ({"plants": np.zeros((1, 9))}, "`plants` must be a batch of plants, but got ndarray"),
        ({"controller": "adfc"}, "`controller` must be a Controller or a sequence of them"),
        ({"controller": [ADFC(), ADFC()]}, "one for each of the 1 trials, but got 2"),
    ],
)
def test_bad_arguments_of_simulate(benchmark, change, message):
    given = {
        "controller": Passthrough(),
        "plants": nominal_plant(),
        "motion": burst(0.3),
        "noise": None,
    } | change
    with pytest.raises(InputError, match=message):
        simulate(benchmark, **given)


def test_all_problems_at_once(benchmark):
    with pytest.raises(InputError, match=r"(?s)2 problems.*`plants` must be.*512 Hz"):
        simulate(benchmark, Passthrough(), np.zeros(9), burst(0.3, fs=512))


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"nb": 8}, "`nb` must be a whole number of at least 9"),
        ({"nb": 100, "no": 100}, r"`no` must lie in \[0, nb - 1 = 99\], but got 100"),
        ({"no": -1}, "`no` must lie in"),
        ({"pull": -1.0}, "`pull` must be zero or positive"),
        ({"pull": float("nan")}, "`pull` must be zero or positive"),
        ({"q": 0.0}, "`q` must be positive"),
        ({"solver": "qr"}, r"`solver` must be one of \['ldl', 'lu'\], but got qr"),
    ],
)
def test_bad_adfc(given, message):
    with pytest.raises(InputError, match=message):
        ADFC(**given)


@pytest.mark.parametrize("name", ["e", "r", "y"])
def test_bad_weights(benchmark, name):
    with pytest.raises(InputError, match=f"`{name}` must be two"):
        LQG.design(benchmark, **{name: (-1.0, 1.0)})


def test_lqg_gain_stabilises_and_solves_its_riccati_equation(benchmark):
    """Against the closed-loop poles and the cost of python-control's solution."""
    import control

    A, B, C = benchmark.plant_continuous
    A_aug = np.block([[A, np.zeros((8, 2))], [-C, np.zeros((2, 2))]])
    B_aug = np.vstack([B, np.zeros((2, 2))])
    e, r, y = (10**6.0, 10**5.0), (1.0, 0.5), (100.0, 10.0)
    Q = np.zeros((10, 10))
    Q[:8, :8], Q[8:, 8:] = C.T @ np.diag(y) @ C, np.diag(e)
    Q = (Q + Q.T) / 2
    expected, _, poles = control.lqr(A_aug, B_aug, Q, np.diag(r))
    ours = LQG.design(benchmark, e=e, r=r, y=y, q=1e-4)
    K_z = np.swapaxes(np.asarray(ours.K_z), 1, 2).reshape(2, 8)
    np.testing.assert_allclose(np.hstack([K_z, ours.K_e]), expected, rtol=1e-5)
    assert poles.real.max() < 0


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class LeadCompensator(martths_jax.Controller):
    """A user's own controller: extrapolates the target by a fixed lead."""

    lead: float
    estimator: object = DirectMeasurement()
    name = "lead"

    def init(self, trials):
        return jnp.zeros((2, trials))

    def step(self, state, seen):
        rate = (seen.x_a - state) / seen.dt
        return seen.x_a, Decision(u=seen.x_a + self.lead * rate)


def test_a_controller_of_ones_own(benchmark):
    """Subclass, two methods, no registration; here it takes half of the delay away."""
    motion = burst()
    plain = indices(simulate(benchmark, LeadCompensator(0.0), nominal_plant(), motion, QUIET))
    led = indices(simulate(benchmark, LeadCompensator(0.015), nominal_plant(), motion, QUIET))
    same = indices(simulate(benchmark, Passthrough(), nominal_plant(), motion, QUIET))
    assert plain["J2_2"] == pytest.approx(same["J2_2"], rel=1e-9)
    assert led["J1_2"][0] < plain["J1_2"][0] - 5
