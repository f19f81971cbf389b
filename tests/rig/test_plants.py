"""Plants of any rig against SciPy and NumPy, and the benchmark's own plants as a special case."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy import linalg, signal

from martths_jax import draw_plants, transfer
from martths_jax.benchmark import continuous_plant
from martths_jax.errors import InputError
from martths_jax.plant import PARAMETERS, SIGMA
from martths_jax.rig.dynamics import TransferMatrix, Written
from martths_jax.rig.entries import Coefficients, ZerosPoles
from martths_jax.rig.model import PlantModel
from martths_jax.rig.numbers import Damped, Scaled
from martths_jax.rig.plants import TransferPlants, draw, from_draws, nominal, table
from martths_jax.rig.statespace import StateSpace
from martths_jax.rig.uncertainty import Uncertainty
from martths_jax.structure.modal import to_dense

DT = 1 / 1024
HZ = 2 * np.pi
F = np.array([0.0, 0.7, 6.0, 45.0, 300.0])


def benchmark_model():
    """The two-actuator benchmark's plant, written as any other rig's."""
    pair, k = Scaled("frame_pair", complex(-50, 63)), transfer.NOMINAL_GAIN
    poles = (("pole1_col1", "pole2_col1", pair), ("pole1_col2", "pole2_col2", pair))
    zeros = ((("zero1_col1", "zero2_col1"), ("zero_h12",)),
             (("zero1_col1", "zero2_col1"), ("zero_h22",)))  # fmt: skip
    entries = [
        [ZerosPoles(zeros[i][j], poles[j], k[i, j], gain_as="nominal") for j in range(2)]
        for i in range(2)
    ]
    uncertain = Uncertainty(PARAMETERS, tuple(transfer.NOMINAL_HZ), tuple(SIGMA), "Hz")
    return PlantModel(TransferMatrix(entries), uncertain)


#: Three inputs, two outputs, entries of all kinds; the gain of (2, 1) and two poles are uncertain.
MIXED = PlantModel(
    TransferMatrix(
        (
            (
                ZerosPoles((-20.0,), (-3.0, "slow", -8 + 30j), 0.9),
                None,
                Coefficients((5.0, "k"), (1.0, 60.0, 4e3, 9e4)),
            ),
            (
                ZerosPoles((), ("slow", -8 + 30j), "k", gain_as="factor", unit="Hz"),
                ZerosPoles((-4 - 9j, -4 + 9j), (-2.0, Damped("high", 0.2), -90.0), 0.5),
                Coefficients((0.0, 7.0), (1.0, 60.0, 4e3, 9e4)),
            ),
        )
    ),
    Uncertainty(("slow", "k", "high"), (-5.0, 3e4, 40.0), (0.1, 0.2, 0.05)),
)


def mixed_functions(slow, k, high):
    """The same transfer functions as (numerator, denominator) of polynomials, entry by entry."""

    def zpk(zeros, poles):
        return [np.atleast_1d(np.poly(np.array(x) * HZ).real) for x in (zeros, poles)]

    def dc(parts, gain):
        return parts[0] * gain * parts[1][-1] / parts[0][-1], parts[1]

    pair = [-8 + 30j, -8 - 30j]
    high = high * np.array([-0.2 + 1j * np.sqrt(0.96), -0.2 - 1j * np.sqrt(0.96)])
    row_2 = zpk([], [slow, *pair])
    shared = [1.0, 60.0, 4e3, 9e4]
    return [
        [dc(zpk([-20], [-3, slow, *pair]), 0.9), None, ([5.0, k], shared)],
        [
            (k * row_2[0], row_2[1]),
            dc(zpk([-4 - 9j, -4 + 9j], [-2, *high, -90]), 0.5),
            ([7.0], shared),
        ],
    ]


def impulses(A, B, C, steps=200):
    """C A^k B, k = 0 ... steps - 1."""
    found, x = [], np.array(B)
    for _ in range(steps):
        found.append(C @ x)
        x = A @ x
    return np.array(found)


def test_the_benchmarks_plants_are_a_special_case():
    model = benchmark_model()
    ours, theirs = draw(model, 5, 3), draw_plants(5, 3)
    np.testing.assert_array_equal(ours.draws, theirs.draws)
    np.testing.assert_array_equal(ours.values, theirs.parameters_hz)
    a, b = ours.discretise(DT), theirs.discretise(DT)
    for name in ("a", "b", "B", "C"):
        expected = np.asarray(getattr(b, name))
        np.testing.assert_allclose(
            getattr(a, name), expected, rtol=1e-11, atol=1e-14 * np.abs(expected).max()
        )
    response = transfer.frequency_response(theirs.parameters_hz, F)
    np.testing.assert_allclose(ours.frequency_response(F), response, rtol=1e-12)
    for found, expected in zip(nominal(model).continuous(), continuous_plant(), strict=True):
        np.testing.assert_allclose(found, expected, rtol=1e-12)
    assert model.lowest_rate == pytest.approx(2 * abs(complex(-50, 63)))


def test_entries_of_all_kinds_are_their_polynomials():
    plants = draw(MIXED, 4, 9)
    H = np.asarray(plants.frequency_response(F))
    A, B, C, _ = to_dense(plants[2].discretise(DT))
    ours = impulses(A, B, C)
    for t, values in enumerate(np.asarray(plants.values)):
        for i, row in enumerate(mixed_functions(*values)):
            for j, entry in enumerate(row):
                if entry is None:
                    assert not np.any(H[:, i, j, t]) and not np.any(ours[:, i, j])
                    continue
                s = 2j * np.pi * F
                expected = np.polyval(entry[0], s) / np.polyval(entry[1], s)
                np.testing.assert_allclose(H[:, i, j, t], expected, rtol=1e-10)
                if t == 2:
                    theirs = signal.cont2discrete(signal.tf2ss(*entry), DT)
                    one = impulses(*theirs[:3])[:, 0, 0]
                    scale = np.abs(one).max()
                    np.testing.assert_allclose(ours[:, i, j] / scale, one / scale, atol=1e-10)


def test_entries_of_a_column_share_the_poles_they_name():
    system = nominal(MIXED).discretise(DT)
    # Column 1: -3, slow, a pair; column 2: -2, -90, a pair; column 3: one real pole with its
    # shadow, a pair.  Nothing twice.
    assert system.a.shape == (2, 6, 1)
    assert system.B.shape == (2, 6, 3, 1) and system.C.shape == (2, 2, 6, 1)


def test_continuous_states_are_those_that_are_sampled():
    plant = table(MIXED, [-4.0, 1e4, 50.0])
    A, B, C = plant.continuous()
    expected = signal.cont2discrete((A, B, C, np.zeros((2, 3))), DT)
    for ours, theirs in zip(to_dense(plant.discretise(DT))[:3], expected[:3], strict=True):
        np.testing.assert_allclose(ours, theirs, rtol=1e-9, atol=1e-12 * np.abs(theirs).max())
    # A batch scatters about its model's nominal plant.
    np.testing.assert_array_equal(draw(MIXED, 3, 1).continuous()[0], nominal(MIXED).continuous()[0])
    assert not np.array_equal(A, nominal(MIXED).continuous()[0])


def frame_rig(stiffness=900.0):
    """Two lagging actuators on a sprung mass with its velocity seen too: A, B, C, uncertain k."""
    A = [
        [-30.0, 0.0, 0.0, -2.0],
        [0.0, -55.0, 0.0, -3.0],
        [0.0, 0.0, 0.0, 1.0],
        [40.0, 25.0, Scaled("k", -1.0) if stiffness is None else -stiffness, -6.0],
    ]
    B = [[30.0, 0.0], [4.0, 55.0], [0.0, 0.0], [0.0, 0.0]]
    C = [[1.0, 0.0, 0.1, 0.0], [0.0, 1.0, -0.1, 0.0], [0.0, 0.0, 1.0, 0.0]]
    return A, B, C


def test_a_state_space_keeps_its_order_and_its_response():
    uncertain = Uncertainty(("k",), (900.0,), (0.2,))
    model = PlantModel(StateSpace(*frame_rig(None)), uncertain)
    plants = draw(model, 4, 11)
    H = np.asarray(plants.frequency_response(F))
    for t, (k,) in enumerate(np.asarray(plants.values)):
        A, B, C = map(np.array, frame_rig(k))
        expected = [C @ np.linalg.solve(2j * np.pi * f * np.eye(4) - A, B) for f in F]
        np.testing.assert_allclose(H[..., t], expected, rtol=1e-9, atol=1e-12)
        system = to_dense(plants[t].discretise(DT))
        assert len(system[0]) == 4
        theirs = signal.cont2discrete((A, B, C, np.zeros((3, 2))), DT)
        expected = impulses(*theirs[:3])
        np.testing.assert_allclose(
            impulses(*system[:3]), expected, atol=1e-11 * np.abs(expected).max()
        )
    A, B, C = nominal(model).continuous()
    np.testing.assert_allclose(
        sorted(np.linalg.eigvals(A), key=lambda z: (z.real, z.imag)),
        sorted(np.linalg.eigvals(np.array(frame_rig()[0])), key=lambda z: (z.real, z.imag)),
        rtol=1e-10,
    )


def test_a_written_plant_is_that_of_its_coefficients():
    def of(p):
        bottom = [1.0, p["d"], p["k"], 4e4]
        return [[[0.0, 2e4], [1.0, p["k"]]], [[0.0], [3.0]]], [bottom, [1.0, 9.0 * p["d"]]]

    uncertain = Uncertainty(("d", "k"), (50.0, 2e3), (3.0, 0.1), kinds=("absolute", "relative"))
    with pytest.raises(InputError, match=r"entry \(1, 2\) is improper: its numerator is of degree"):
        PlantModel(Written(of, 2, 2), uncertain)

    def proper(p):
        top, bottom = of(p)
        top[0][1] = [p["k"]]
        return top, bottom

    plants = draw(PlantModel(Written(proper, 2, 2), uncertain), 3, 5)
    assert plants.discretise(DT).a.shape == (2, 3, 3)
    H, s = np.asarray(plants.frequency_response(F)), 2j * np.pi * F
    for t, (d, k) in enumerate(np.asarray(plants.values)):
        np.testing.assert_allclose(H[:, 0, 0, t], 2e4 / np.polyval([1, d, k, 4e4], s), rtol=1e-12)
        np.testing.assert_allclose(H[:, 0, 1, t], k / (s + 9 * d), rtol=1e-12)
        np.testing.assert_allclose(H[:, 1, 1, t], 3 / (s + 9 * d), rtol=1e-12)
        assert not np.any(H[:, 1, 0, t])


def test_what_gain_as_keeps():
    uncertain = Uncertainty(("p",), (-5.0,), (0.3,))
    z, p = [-20.0 * HZ], [-5.0 * HZ, -40.0 * HZ]
    static = -z[0] / (p[0] * p[1])  # of the factor one
    given = {"dc": 0.8, "nominal": 0.8 / static, "factor": 0.8 / static}
    for way, gain in given.items():
        model = PlantModel(
            TransferMatrix(((ZerosPoles((-20.0,), ("p", -40.0), gain, gain_as=way),),)), uncertain
        )
        values = table(model, [[-5.0], [-10.0]])
        found = np.asarray(values.frequency_response([0.0])).real.ravel()
        expected = [0.8, 0.4] if way == "factor" else [0.8, 0.8]
        np.testing.assert_allclose(found, expected, rtol=1e-14)


def test_units_of_zeros_and_poles():
    hz = ZerosPoles((-20.0,), (-3.0, -8 + 30j), 0.9)
    rad = ZerosPoles((-20.0 * HZ,), (-3.0 * HZ, (-8 + 30j) * HZ), 0.9, unit="rad/s")
    ours, theirs = (nominal(PlantModel(TransferMatrix(((e,),)))).discretise(DT) for e in (hz, rad))
    np.testing.assert_allclose(ours.C, theirs.C, rtol=1e-14)


def test_trials_depend_on_seed_and_number_alone_and_keep_their_numbers():
    many, few = draw(MIXED, 20, 7), draw(MIXED, 2, 7, first=11)
    np.testing.assert_array_equal(many.draws[10:12], few.draws)
    np.testing.assert_array_equal(many[10:12].trial, [11, 12])
    assert len(many[3]) == 1 and len(many[np.array([True] + [False] * 19)]) == 1
    values = table(MIXED, np.asarray(many.values))
    np.testing.assert_array_equal(values.values, many.values)
    np.testing.assert_array_equal(values[4:6].values, many.values[4:6])
    np.testing.assert_array_equal(nominal(MIXED).values, [[-5.0, 3e4, 40.0]])
    np.testing.assert_array_equal(draw(MIXED, 3, 7, spread=0.0).values, [[-5.0, 3e4, 40.0]] * 3)


def test_draws_scatter_about_another_plant():
    other = table(MIXED, [-6.0, 1e4, 50.0])
    about, usual = draw(MIXED, 4, 7, around=other), draw(MIXED, 4, 7)
    factor = np.array([[6 / 5, 1 / 3, 5 / 4]])
    np.testing.assert_allclose(about.values, usual.values * factor, rtol=1e-14)
    np.testing.assert_array_equal(about.continuous()[0], other.continuous()[0])
    with pytest.raises(InputError, match="`around` must be one plant of the same model"):
        draw(MIXED, 4, around=about)


def test_no_parameter_is_uncertain():
    model = PlantModel(StateSpace(*frame_rig()))
    plants = draw(model, 3)
    assert plants.values.shape == (3, 0) and plants.discretise(DT).a.shape == (2, 2, 3)


def test_derivatives_go_through_jit_to_the_draws():
    """Of the first output's response to unit impulses on all inputs, by differences."""

    @jax.jit
    def total(draws):
        system = TransferPlants(draws, jnp.arange(1), MIXED).discretise(DT)
        x = jnp.sum(system.B, axis=2)
        after = system.a * x + system.b * x[::-1]
        return jnp.sum(system.C[0] * after)

    z = jnp.array([[0.3, -0.2, 0.6]])
    slope = np.asarray(jax.grad(total)(z))[0]
    for i in range(2):
        step = jnp.zeros((1, 3)).at[0, i].set(1e-4)
        difference = (total(z + step) - total(z - step)) / 2e-4
        np.testing.assert_allclose(slope[i], difference, rtol=1e-6)
    assert slope[2] == 0  # the third parameter acts on the second output alone


def test_sharded_over_trials_like_other_batches():
    """Every leaf has the trials first, or no axis."""
    leaves = jax.tree.leaves(table(MIXED, np.ones((4, 3)) * [-5.0, 3e4, 40.0]))
    assert {np.shape(x)[:1] for x in leaves} == {(4,), ()}
    assert hash(MIXED) == hash(PlantModel(MIXED.dynamics, MIXED.uncertainty))


def one(entry):
    return PlantModel(TransferMatrix(((entry,),)), Uncertainty(("p",), (-5.0,), (0.3,)))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: one(ZerosPoles((-1.0,), (-2.0,), 1.0)),
         r"entry \(1, 1\) is improper: its numerator is of degree 1, its denominator of degree 1"),
        (lambda: one(ZerosPoles((), (-2.0, 3.0), 1.0)), "has an unstable pole, 3 Hz, for the nom"),
        (lambda: one(ZerosPoles((), (2 + 5j,), 1.0)), r"unstable pole, 2\+5j Hz"),
        (lambda: one(ZerosPoles((), (0.0, -1.0), 1.0)), "unstable pole, 0 Hz"),
        (lambda: one(ZerosPoles((), ("p", -5.0), 1.0)), "nearly equal poles, -5 Hz and -5 Hz, and"),
        (lambda: one(Coefficients((1.0,), (1.0, 2.0, 1.0, 0.5, 7.0))), "has an unstable pole"),
        (lambda: one(Coefficients((1.0,), (1.0, 4.0, 4.0))), "has nearly equal poles"),
        (lambda: one(Coefficients((1.0,), np.poly([-3.0, -3.0, -3.0]))), "has nearly equal poles"),
        (lambda: one(ZerosPoles((0.0,), ("p", -2.0), 1.0)), "has no finite static gain"),
        (lambda: one(ZerosPoles((), ("q",), 1.0)),
         r"`dynamics` must name uncertain parameters only \(p\), but got 'q'"),
        (lambda: one(None), "`entries` must let every input act on an output"),
        (lambda: TransferMatrix(((None, None), (None,))), "be rows of equal length"),
        (lambda: TransferMatrix(((1.0,),)), r"hold ZerosPoles, Coefficients or None, but got 1.0"),
        (lambda: ZerosPoles((), (np.nan,), 1.0), "`poles` must be a finite number or the name"),
        (lambda: ZerosPoles((), (-1.0,), 1j), "`gain` must be real"),
        (lambda: ZerosPoles((), (-1.0,), "p", gain_as="nominal"), "Use gain_as dc or factor"),
        (lambda: ZerosPoles((), (-1.0,), 1.0, unit="kHz"), "`unit` must be one of Hz, rad/s"),
        (lambda: Coefficients((), (1.0,)), "`numerator` must hold a number other than zero"),
        (lambda: Coefficients((1.0,), (0.0,)), "`denominator` must hold a number other than zero"),
        (lambda: StateSpace([[-1.0]], [[1.0]], [[1.0, 2.0]]), r"`C` must have 1 rows of 1 numbers"),
        (lambda: PlantModel(StateSpace([[-1.0, 0.0], [0.0, -2.0]], [[1.0], [0.0]], [[1.0, 1.0]])),
         "must have no states that inputs do not move"),
        (lambda: PlantModel(Written(lambda p: ([[[1.0]]], [[1.0, p["q"]]]), 1, 1)),
         "`of` must use no parameters but none, but got 'q'"),
        (lambda: PlantModel(Written(lambda p: ([[[1.0]]], [[1.0, 2.0]]), 2, 1)),
         "`of` must return 2 rows of 1 numerators"),
        (lambda: PlantModel(None), "`dynamics` must be of the kind Dynamics, but got None"),
        (lambda: nominal(MIXED).discretise(1 / 100), "90 Hz"),
    ],
)  # fmt: skip
def test_refusals(make, message):
    with pytest.raises(InputError, match=message):
        make()


SLOW = one(ZerosPoles((), ("p", -40.0), 1.0))
PAIR = PlantModel(
    TransferMatrix(((Coefficients((1.0,), (1.0, "d", 1.0)),),)), Uncertainty(("d",), (1.0,), (0.3,))
)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: from_draws(SLOW, [[0.0], [-4.0]]), r"unstable pole, 1 Hz in row 1 \(trial 1: p ="),
        (lambda: table(SLOW, [[-5.0], [-40.0]]), r"nearly equal poles, -40 Hz and -40 Hz.* row 1"),
        (lambda: table(PAIR, [[1.0], [2.5]]), "other numbers of real poles and of pairs.* row 1"),
        (lambda: from_draws(SLOW, [[np.nan]]), "`draws` must be finite, but got nan for p in row"),
        (lambda: from_draws(SLOW, [1.0, 2.0]), r"shape \(1,\) or \(trials, 1\), but got shape"),
        (lambda: draw(SLOW, 0), "`n` must be a whole number"),
        (lambda: draw(SLOW, 1, -1), "`seed` must be"),
        (lambda: draw(SLOW, 1, spread=-1.0), "`spread` must be zero or positive"),
    ],
)
def test_refused_draws(make, message):
    with pytest.raises(InputError, match=message):
        make()


def test_the_discrete_system_is_the_matrix_exponential():
    """One entry by expm, without any transfer function between."""
    A, B, C = frame_rig()
    model = PlantModel(StateSpace(A, B, C))
    big = np.zeros((6, 6))
    big[:4, :4], big[:4, 4:] = A, B
    turned = linalg.expm(big * DT)
    expected = impulses(turned[:4, :4], turned[:4, 4:], np.array(C), 50)
    found = impulses(*to_dense(nominal(model).discretise(DT))[:3], 50)
    np.testing.assert_allclose(found, expected, atol=1e-12 * np.abs(expected).max())
