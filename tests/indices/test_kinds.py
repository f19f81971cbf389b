"""Every index beside the benchmark's against NumPy on the signals of a run, and what it tells."""

import re
from dataclasses import dataclass, replace
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest

from martths_jax import (
    ADFC,
    LQG,
    InputError,
    Passthrough,
    SensorNoise,
    draw_plants,
    indices,
    load_motion,
    nominal_plant,
    simulate,
)
from martths_jax.coupler import frame_to_actuator
from martths_jax.indices import (
    BENCHMARK,
    DELAYS,
    GROUPS,
    KNOWN,
    NAMES,
    FrequencyEvaluation,
    Index,
    Kind,
    Pair,
    Rms,
    choose,
    observers_of,
)
from martths_jax.indices.frequency import BAND, STEP
from martths_jax.simulation import reference_response
from tests.engine.motions import burst
from tests.indices.guest import BOTH, MEAN

FS = 1024.0
ALL = ("benchmark", "true", "tracking", "frequency", *BOTH)


@pytest.fixture(scope="module")
def run(benchmark):
    """Three plants under LQG with all indices and a known noise, and the noise."""
    motion = burst(seconds=0.9)
    noise = 0.02 * np.random.default_rng(3).standard_normal((motion.acceleration.size, 2))
    controller = LQG.design(benchmark)
    plants = draw_plants(3, 1)
    return (
        simulate(benchmark, controller, plants, motion, noise, keep=True, indices=ALL),
        simulate(benchmark, controller, plants, motion, noise),
        noise,
    )


def spectrum(x, fs=FS):
    """(N, T) signal -> frequencies and (F, T) Fourier sums on the grid of the band."""
    f = np.arange(BAND[0], BAND[1] + STEP / 2, STEP)
    return f, np.exp(-2j * np.pi * f[:, None] * np.arange(len(x)) / fs) @ x


def test_the_benchmarks_indices_do_not_mind_others_beside_them(run):
    found, usual, _ = run
    assert list(indices(usual)) == list(NAMES)
    assert list(indices(found)) == [index.name for index in choose(ALL)]
    for name in NAMES:
        np.testing.assert_allclose(indices(found)[name], indices(usual)[name], rtol=1e-12)


def test_true_strokes(run):
    result, _, noise = run
    found, s = indices(result), result.signals
    for i in (0, 1):
        x_a = s["x_a"][..., i].T
        error = s["x_m"][..., i].T - noise[:, i, None] - x_a
        rms = 100 * np.sqrt(np.sum(error**2, 0) / np.sum(x_a**2, 0))
        peak = 100 * np.max(np.abs(error), 0) / np.max(np.abs(x_a), 0)
        np.testing.assert_allclose(found[f"J2true_{i + 1}"], rms, rtol=1e-9)
        np.testing.assert_allclose(found[f"J3true_{i + 1}"], peak, rtol=1e-9)
        # The noise's share of J2 is what the draw and the error make it.
        share = np.sum(noise[:, i, None] * (noise[:, i, None] + 2 * error), 0) / np.sum(x_a**2, 0)
        parted = found[f"J2_{i + 1}"] ** 2 - found[f"J2true_{i + 1}"] ** 2
        np.testing.assert_allclose(parted, 1e4 * share, rtol=1e-9)
    assert "x" not in s  # what observers see and nobody stores


def test_the_tracking_indicator(run):
    """By its definition: two areas, summed by the trapezoidal rule."""
    result, _, _ = run
    found, s = indices(result), result.signals
    for i in (0, 1):
        c, m = s["x_a"][..., i], s["x_m"][..., i]
        A = np.cumsum(0.5 * (c[:, 1:] + c[:, :-1]) * np.diff(m), axis=1)
        TA = np.cumsum(0.5 * (m[:, 1:] + m[:, :-1]) * np.diff(c), axis=1)
        TI = np.pad(0.5 * (A - TA), ((0, 0), (1, 0)))
        np.testing.assert_allclose(found[f"TI_{i + 1}"], TI[:, -1], rtol=1e-9)
        rms = np.sqrt(np.mean(TI**2, axis=1))
        np.testing.assert_allclose(found[f"TIrms_{i + 1}"], rms, rtol=1e-9)


def test_the_frequency_evaluation_index(run):
    result, _, _ = run
    found, s = indices(result), result.signals
    for i in (0, 1):
        f, X = spectrum(s["x_a"][..., i].T)
        _, Y = spectrum(s["x_m"][..., i].T)
        weight = np.abs(X) ** 2 / np.sum(np.abs(X) ** 2, axis=0)
        index, f_eq = np.sum(Y / X * weight, axis=0), f @ weight
        np.testing.assert_allclose(found[f"FEIamp_{i + 1}"], 100 * (np.abs(index) - 1), rtol=1e-9)
        delay = -1e3 * np.angle(index) / (2 * np.pi * f_eq)
        np.testing.assert_allclose(found[f"FEIdelay_{i + 1}"], delay, rtol=1e-9)


def test_an_index_of_ones_own(run):
    result, _, _ = run
    found, s = indices(result), result.signals
    for i in (0, 1):
        error = np.abs(s["x_m"] - s["x_a"])[..., i]
        np.testing.assert_allclose(found[f"mean_{i + 1}"], error.mean(axis=1), rtol=1e-9)


def watched(index, x_a, x_m, pieces):
    """An index of (N,) signals, handed over in pieces of so many samples."""
    (observer,) = observers_of((index,), FS)
    state, start = observer.init(1), 0
    for n in pieces:
        piece = {"x_a": x_a[start : start + n], "x_m": x_m[start : start + n]}
        piece = {k: jnp.asarray(np.stack([v, v], axis=1)[..., None]) for k, v in piece.items()}
        state, start = observer.add_piece(state, piece), start + n
    assert start == len(x_a)
    value, missing = observer.result(observer.finish(state))[index.of]
    assert not missing[0, 0]
    return float(value[0, 0])


def test_fei_is_that_of_the_records_own_transform():
    """A stroke of 0.9 that comes 7 samples late, over more than two periods of the folding."""
    n = 20_000
    t = np.arange(n) / FS
    wave = lambda t: np.sin(2 * np.pi * 1.9 * t) * np.exp(-(((t - 8) / 2) ** 2))  # noqa: E731
    x_a, x_m = wave(t) + 0.3 * wave(1.7 * t - 3), 0.9 * (wave(t - 7 / FS))
    x_m = x_m + 0.27 * wave(1.7 * (t - 7 / FS) - 3)
    X, Y, f = np.fft.rfft(x_a), np.fft.rfft(x_m), np.fft.rfftfreq(n, 1 / FS)
    weight = np.abs(X) ** 2 / np.sum(np.abs(X) ** 2)
    index = np.sum(Y * np.conj(X)) / np.sum(np.abs(X) ** 2)
    delay = -1e3 * np.angle(index) / (2 * np.pi * (f @ weight))
    for pieces in ([256] * 78 + [32], [7, 9000, 10_993]):
        amp = watched(KNOWN["FEIamp_1"], x_a, x_m, pieces)
        late = watched(KNOWN["FEIdelay_1"], x_a, x_m, pieces)
        assert amp == pytest.approx(100 * (np.abs(index) - 1), rel=2e-4)
        assert late == pytest.approx(delay, rel=2e-4) == pytest.approx(7e3 / FS, rel=1e-2)


def test_the_power_of_the_weight_is_a_setting():
    x_a = np.random.default_rng(0).standard_normal(3000)
    x_m = np.convolve(x_a, [0.3, 0.4, 0.2])[:3000]
    index = replace(KNOWN["FEIamp_1"], name="own_1", kind=FrequencyEvaluation(power=1))
    _, X = spectrum(x_a[:, None])
    _, Y = spectrum(x_m[:, None])
    expected = 100 * (np.abs(np.sum(Y / X * np.abs(X)) / np.sum(np.abs(X))) - 1)
    assert watched(index, x_a, x_m, [3000]) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("lag", [0.0, 0.1, -0.2])
def test_ti_adds_the_sine_of_the_lag_every_cycle(lag):
    k, cycles, size = np.arange(4096), 4, 2.5
    angle = 2 * np.pi * cycles * k / 4096
    (observer,) = observers_of((KNOWN["TI_1"],), FS)
    state = observer.init(1)
    for j in (*k, 0):  # once around
        strokes = {"x_a": size * np.sin(angle[j]), "x_m": 0.8 * size * np.sin(angle[j] - lag)}
        now = {name: np.full((2, 1), x) for name, x in strokes.items()}
        state = observer.add(state, now, None, np.asarray(j), np.asarray(True))
    value, _ = observer.result(observer.finish(state))["last"]
    expected = cycles * np.pi * 0.8 * size**2 * np.sin(lag)
    assert float(value[0, 0]) == pytest.approx(expected, rel=1e-4, abs=1e-9)


def floor_of(benchmark, motion):
    """What noise adds to J2 of ADFC on the nominal plant [%], and the targets in the loop [mm]."""
    run = simulate(benchmark, ADFC(), nominal_plant(), motion, indices=("J2", "true"), keep=True)
    J = indices(run)
    share = [np.sqrt(J[f"J2_{i}"][0] ** 2 - J[f"J2true_{i}"][0] ** 2) for i in (1, 2)]
    return np.array(share), np.sqrt(np.mean(run.signals["x_a"][0] ** 2, axis=0))


@pytest.mark.slow
def test_the_floor_on_a_built_in_motion(benchmark):
    """The noise's deviation over the target's rms, within what a draw and the error allow."""
    share, target = floor_of(benchmark, load_motion("elcentro-like", scale=0.4, fs=1024))
    deviation = np.sqrt(SensorNoise().noise_power * benchmark.fs)
    np.testing.assert_allclose(share, 100 * deviation / target, rtol=0.03)


@pytest.mark.slow
def test_the_floors_on_the_real_records(benchmark, records):
    """3.12 and 1.63 % of the reference's strokes, mean of El Centro, Kobe and Morgan Hill; of the
    loop's own targets, which are smaller, 3.41 and 1.74 %."""
    shares, of_reference = [], []
    for name in ("elcentro", "kobe", "morganhill"):
        motion = load_motion(name, scale=0.4, fs=1024, records=records)
        share, target = floor_of(benchmark, motion)
        response = reference_response(benchmark, jnp.asarray(motion.acceleration))
        strokes = frame_to_actuator(benchmark.coupler, response[:, :2].T)
        shares.append(share)
        of_reference.append(share * target / np.sqrt(np.mean(np.asarray(strokes) ** 2, axis=1)))
    np.testing.assert_allclose(np.mean(of_reference, axis=0), [3.12, 1.63], rtol=0.01)
    np.testing.assert_allclose(np.mean(shares, axis=0), [3.41, 1.74], rtol=0.01)


def test_only_what_is_asked_for(benchmark):
    one = simulate(benchmark, Passthrough(), draw_plants(2, 1), burst(), indices="j2, TI_2")
    assert list(indices(one)) == ["J2_1", "J2_2", "TI_2"]
    assert not [o for o in one.sums.observers if o.pieces]  # no correlations to pay for
    assert [i.unit for i in one.sums.indices] == ["%", "%", "mm²"]


def test_the_page_names_them_all():
    text = (Path(__file__).resolve().parents[2] / "docs" / "indices.md").read_text("utf-8")
    rows = [line for line in text.splitlines() if line.startswith("| ")]
    words = {word for row in rows for word in re.findall(r"\w+", row)}
    assert {index.group for index in KNOWN.values()} | set(GROUPS) <= words


def test_the_table():
    assert tuple(i.name for i in BENCHMARK) == NAMES and len(NAMES) == 24
    assert {i.name for i in BENCHMARK if i.unit == "ms"} == set(DELAYS)
    assert all(i.label and i.source for i in KNOWN.values())
    assert choose() == BENCHMARK and choose("J2_1") == (KNOWN["J2_1"],)
    assert choose(["tests.indices.guest:BOTH", MEAN]) == BOTH


@dataclass(frozen=True, kw_only=True)
class Other(Kind):
    """Another kind."""


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ("J2_3", r"'J2_3' is unknown; the nearest are .*J2_1"),
        (["J2", 5], "but got int"),
        ([], "at least one"),
        ("tests.indices.guest:MEEN", "'MEEN', which is not there; did you mean 'MEAN'"),
        ("tests.indices.none:MEAN", "cannot be imported: ModuleNotFoundError"),
        ("none/own.py:MEAN", "Index file none/own.py cannot be read"),
        ("tests.indices.guest:MeanError", "must be an Index"),
        ([Index("J2_1", "mm", Other(), Pair.of("x_m", "x_a", 0))], "called 'J2_1'"),
    ],
)
def test_what_cannot_be_meant_is_one_sentence(given, words):
    with pytest.raises(InputError, match=words):
        choose(given)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"name": "J2 true"}, "letters and digits"),
        ({"kind": Rms}, "must have a Kind"),
        ({"of": "phase"}, "`of` must be one of ''"),
    ],
)
def test_a_row_that_cannot_be(changes, words):
    row = {"name": "own_1", "unit": "mm", "kind": Rms(), "pair": Pair.of("x_m", "x_a", 0)}
    with pytest.raises(InputError, match=words):
        Index(**(row | changes))
