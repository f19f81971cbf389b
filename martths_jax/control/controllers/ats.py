"""Adaptive time series compensator (Chae, Kazemibidokhti & Ricles 2013).

    u(k) = a_0 x_a(k) + a_1 x_a'(k) + a_2 x_a''(k)
    a    = argmin sum over the window of |F[u](k-1) - (F[x_m], F[x_m]', F[x_m]'')(k) a|^2

one fit an actuator, F a low-pass on both sides.  The equations and the published numbers are those
of the design notes, taken from the authors' settings file; what these do not say is said in
``ATS.design``.  Chae, Y., Kazemibidokhti, K. & Ricles, J. M. (2013), Earthquake Engineering &
Structural Dynamics 42(11), 1697-1715.
"""

from __future__ import annotations

from dataclasses import dataclass
from types import MappingProxyType

import jax
import jax.numpy as jnp
import numpy as np

from martths_jax.control.adaptive.arguments import known
from martths_jax.control.adaptive.base import ACTUATORS
from martths_jax.control.adaptive.differences import BackwardDifferences
from martths_jax.control.adaptive.guards import (
    Bounds,
    ConditionGate,
    MotionThreshold,
    RateLimit,
    ShapedPull,
)
from martths_jax.control.adaptive.lowpass import butterworth
from martths_jax.control.adaptive.weighted import WeightedWindow
from martths_jax.control.controllers.feedforward import AdaptiveFeedforward
from martths_jax.control.entry import Entry, Parameter
from martths_jax.errors import argument_error

ORDER = 2
REGRESSOR = BackwardDifferences(order=ORDER, accuracy=2)
#: What makes the columns x, x', x'' of a motion near 2 Hz equally large [s].
COLUMN_S = 0.02
#: Published settings and one for this benchmark: window [s], every so manyth sample, threshold of
#: the mean stroke [mm], low-pass of `order` poles [Hz], bounds and largest change a second of
#: a_0 [-], a_1 [s], a_2 [s^2].
PRESETS = MappingProxyType({
    "chae2013": {
        "window": 1.0, "every": 16, "threshold": 0.254, "poles": 6, "cutoff": 20.0,
        "low": (0.7, 0.0, 0.0), "high": (1.3, 0.080, 0.0032), "rate": (2.0, 0.05, 0.001),
    },
    "chae2013-narrow": {
        "window": 1.0, "every": 16, "threshold": 0.254, "poles": 6, "cutoff": 20.0,
        "low": (0.9, 0.0, 0.0), "high": (1.1, 0.060, 0.0032), "rate": (0.2, 0.005, 0.0001),
    },
    "benchmark": {
        "window": 1.0, "every": 1, "threshold": 0.05, "poles": 6, "cutoff": 20.0,
        "low": (0.7, 0.0, 0.0), "high": (1.3, 0.080, 0.0032), "rate": (2.0, 0.05, 0.001),
    },
})  # fmt: skip
#: Delays a_1 that the coefficients start from: those of the nominal plant's two actuators [s].
DELAY_S = (0.042, 0.025)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class ATS(AdaptiveFeedforward):
    """Pieces of ``AdaptiveFeedforward`` as the adaptive time series takes them; see ``design``."""

    name = "ats"
    actuators_needed = 2
    first_lag_range = 1

    @classmethod
    def design(
        cls,
        benchmark,
        *,
        preset: str = "benchmark",
        window: float | None = None,
        every: int | None = None,
        threshold: float | None = None,
        cutoff: float | None = None,
        ridge: float = 0.0,
        delay: tuple[float, float] = DELAY_S,
        q: float = 3e-5,
    ) -> ATS:
        """The controller with published settings, or one's own instead of some of them.

        The coefficients start at a_0 = 1, a_1 = delay, a_2 = delay^2 / 2.  New ones come every
        sample and move by at most the published change a second times dt; then the bounds cut
        them.  Derivatives are backward differences of second-order accuracy, on both sides alike.

        Args:
            benchmark: gives the sampling rate, the nominal plant and the sensor noise.
            preset: settings of ``PRESETS`` that hold where none is given here.
            window: memory of the fit [s].
            every: each so manyth sample is used.
            threshold: no new coefficients while the mean |F[x_m]| is smaller [mm]; the mean fades
                with the window's length.
            cutoff: of the low-pass on both sides [Hz].
            ridge: lambda, adds lambda N |b - b_0|^2 with N the pairs in the window, b the
                coefficients in columns scaled by (1, 0.02 s, 4e-4 s^2), b_0 the start [mm^2].
            delay: of the two actuators [s].
            q: process noise of the Kalman filter that the force is made from; the fit learns from
                the measured strokes [mm^2].

        Raises:
            InputError: an unknown preset, a window with fewer pairs than a fit needs, or a
                cutoff at or beyond half the sampling rate.
        """
        if preset not in PRESETS:
            raise argument_error("preset", f"be one of {', '.join(PRESETS)}", repr(preset))
        own = dict(PRESETS[preset])
        given = {"window": window, "every": every, "threshold": threshold, "cutoff": cutoff}
        own |= {name: value for name, value in given.items() if value is not None}
        fs, start = benchmark.fs, start_from(benchmark.fs, delay)
        nb, every = window_samples(fs, own["window"], own["every"])
        check_cutoff(fs, own["cutoff"])
        powers = fs ** np.arange(ORDER + 1.0)  # a_j in s^j -> coefficient of dt^j x^(j)
        shape = jnp.asarray((COLUMN_S * fs) ** (-2.0 * np.arange(ORDER + 1)))
        return cls(
            regressor=REGRESSOR,
            fit=WeightedWindow(nb, every=every),
            guards=(
                ShapedPull(ridge * (nb // every) * shape),
                ConditionGate(),
                MotionThreshold(own["threshold"], float(nb)),
                RateLimit(np.array(own["rate"]) * powers / fs),
                Bounds(np.array(own["low"]) * powers, np.array(own["high"]) * powers),
            ),
            start=start,
            joint=False,
            learns_from="measurement",
            low_pass=butterworth(own["poles"], own["cutoff"], fs),
            q=q,
        )


def start_from(fs: float, delay) -> jax.Array:
    """(3, 2) coefficients (1, delay, delay^2 / 2) of both actuators in scaled derivatives."""
    samples = jnp.asarray(delay, dtype=float) * fs
    if known(samples) is not None and samples.shape != (ACTUATORS,):
        raise argument_error("delay", "be two numbers (s)", f"{delay!r:.80}")
    return jnp.stack([jnp.ones(ACTUATORS), samples, samples**2 / 2])


def window_samples(fs: float, window: float, every: int) -> tuple[int, int]:
    """Samples N_b of a window [s], cut to a multiple of `every`, and `every`, both whole.

    Raises:
        InputError: fewer pairs than unknowns + 1.
    """
    nb, every = round(fs * window), int(every)
    least = ORDER + 2
    if every < 1 or nb // every < least:
        raise argument_error(
            "window", f"hold at least {least} pairs for {ORDER + 1} unknowns",
            f"{nb} samples of which every {every}. is used",
        )  # fmt: skip
    if nb % every:
        # A pair must leave as it came: the next shorter window is as good.
        nb -= nb % every
    return nb, every


def check_cutoff(fs: float, cutoff: float) -> None:
    """Refuse a low-pass that the sampling rate cannot hold.

    Raises:
        InputError: at or beyond half the sampling rate.
    """
    if not 0 < cutoff < fs / 2:
        wanted = f"lie between 0 and {fs / 2:g} Hz, half the sampling rate"
        raise argument_error("cutoff", wanted, f"{cutoff:g}")


ENTRY = Entry(
    name="ats",
    controller=ATS,
    make=ATS.design,
    label="ATS",
    paper="Chae, Kazemibidokhti & Ricles 2013, EESD 42(11), adaptive time series",
    parameters=(
        Parameter("preset", "", "settings that hold where none is given", "benchmark",
                  choices=tuple(PRESETS), kind="static"),
        Parameter("window", "T_w", "window", None, "s", 0.0, above=True, kind="static"),
        Parameter("every", "m", "each so manyth sample is used", None, "samples", 1, whole=True,
                  kind="static"),
        Parameter("threshold", "x_min", "mean stroke below which it holds", None, "mm", 0.0),
        Parameter("cutoff", "f_c", "cutoff of the low-pass", None, "Hz", 0.0, above=True,
                  kind="static"),
        Parameter("ridge", "lambda", "pull to the start", 0.0, "mm^2", 0.0),
        Parameter("delay", "a_1", "delays that it starts from", DELAY_S, "s", 0.0, 0.08, size=2),
        Parameter("q", "q", "process noise", 3e-5, "mm^2", 0.0, above=True),
    ),
    tuned=(
        Parameter("threshold", "x_min", "mean stroke below which it holds", 0.05, "mm", 0.0,
                  above=True),
        Parameter("ridge", "lambda", "pull to the start", 1e-4, "mm^2", 0.0, above=True),
    ),
)  # fmt: skip
