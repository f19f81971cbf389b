"""RoDeAC: decentralised adaptive compensation by four-tap FIR filters (Quiroz et al. 2024).

Each actuator has its own filter, whose taps are the recursive least-squares inverse of that
actuator; there is no model of the plant:

    u(k)     = theta(k)' (x_a(k), x_a(k-1), x_a(k-2), x_a(k-3))
    phi(k)   = (y(k), y(k-1), y(k-2), y(k-3)),   y = F[x_m]
    g        = P phi / (mu + phi' P phi)
    theta(k) = theta(k-1) + g (F[u](k) - phi' theta(k-1)),   P = (P - g phi' P) / mu

with F a Butterworth low-pass of fourth order at 20 Hz, at rest before the first sample.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from martths_jax.control.adaptive.arguments import check_positive, complaint, known
from martths_jax.control.adaptive.base import Pair
from martths_jax.control.adaptive.lowpass import butterworth
from martths_jax.control.adaptive.recursive import Recursive
from martths_jax.control.adaptive.taps import fir
from martths_jax.control.base import Controller, Decision
from martths_jax.control.controllers.feedforward import SIGNALS, AdaptiveFeedforward
from martths_jax.control.entry import Entry, Parameter
from martths_jax.control.estimators import DirectMeasurement, design_kalman

#: theta_0 of the authors' public package, one column an actuator.
START = np.array([
    [5.41470353, 6.05817263],
    [1.96280665, 2.19981575],
    [-1.50482526, -1.67459763],
    [-4.95776380, -5.53849986],
])  # fmt: skip
#: P_0 of the package [1/m^2], upper triangles row by row, one row an actuator.
PRIOR_UPPER = np.array([
    [83906.43, -45046.01, -27999.33, -10761.29, 106712.78, -33590.12, -27999.86, 106712.89,
     -45046.65, 83907.60],
    [64773.01, -51448.24, -21629.93, 8337.19, 104560.94, -31474.35, -21630.10, 104561.23,
     -51448.71, 64773.65],
])  # fmt: skip
TAPS = 4
#: Sampling rate that the package's taps belong to [Hz].
RATE = 1024.0
#: Order of F.
ORDER = 4
#: What P_0 is multiplied by.  The package identified it from signals in metres and runs it on
#: signals in millimetres (``published``); in one unit it would be 1e-6 of that (``consistent``).
UNITS = {"published": 1.0, "consistent": 1e-6}
#: Which command a sample's strokes are paired with: the one decided at the same sample, as in the
#: package, or the one before, the last that they can have felt.
PAIRINGS = ("same", "previous")


def prior() -> np.ndarray:
    """(2, 4, 4) P_0 of the package, one matrix an actuator [1/m^2]."""
    found = np.zeros((2, TAPS, TAPS))
    for matrix, numbers in zip(found, PRIOR_UPPER, strict=True):
        rows, columns = np.triu_indices(TAPS)
        matrix[rows, columns] = matrix[columns, rows] = numbers
    return found


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class RoDeAC(Controller):
    """The equations above for each actuator.

    Attributes:
        units: ``published`` or ``consistent``, see ``UNITS``.  With the published quirk the fit
            starts almost free, without it the taps hardly leave the start.
        prior_scale: further factor of P_0; 1e-2 is between both units.
        forgetting: factor mu a sample, at most 1.
        pairing: ``same`` or ``previous``, see ``PAIRINGS``.
        cutoff_hz: corner of F [Hz].
        q: process noise of a Kalman filter that gives the estimate [mm^2]; None, as in the package,
            hands the measured strokes on.  The taps learn from the measured strokes either way.
        prior: (2, 4, 4) P_0 [1/mm^2] once it is prepared, or one of one's own before.
        start: (4, 2) taps theta_0.
        fs: sampling rate that F is designed for, from ``prepare`` [Hz].
        estimator: designed by ``prepare``.

    With ``same`` u(k) depends on theta(k), which depends on F[u](k) = b_0 u(k) + h, h all that F
    remembers.  Both are linear, so that with q = (x_a(k), ..., x_a(k-3))

        u(k) = (theta(k-1) + g (h - phi' theta(k-1)))' q / (1 - b_0 g' q)

    solves the loop exactly.
    """

    units: str = field(default="published", metadata={"static": True})
    prior_scale: jax.Array | float = 1.0
    forgetting: jax.Array | float = 1.0
    pairing: str = field(default="same", metadata={"static": True})
    cutoff_hz: float = field(default=20.0, metadata={"static": True})
    q: float | None = field(default=None, metadata={"static": True})
    prior: jax.Array | None = None
    start: jax.Array | None = None
    fs: float = field(default=RATE, metadata={"static": True})
    estimator: Any = None

    name = "rodeac"
    actuators_needed = 2
    adapts = True
    signals = SIGNALS[:1]
    shared_axes = MappingProxyType({"prior_scale": 0, "forgetting": 0, "prior": 3, "start": 2})

    def composed(self) -> AdaptiveFeedforward:
        """The same as pieces, which pair strokes with the command before."""
        return AdaptiveFeedforward(
            regressor=fir(TAPS),
            fit=Recursive(self.prior, self.forgetting),
            start=self.start,
            joint=False,
            learns_from="measurement",
            low_pass=butterworth(ORDER, self.cutoff_hz, self.fs),
            estimator=self.estimator,
        )

    def problems(self, benchmark):
        fs = RATE if benchmark is None else benchmark.fs
        mu = known(self.forgetting)
        own = self.start is not None
        found = [
            *complaint(self.units in UNITS, "units", f"be one of {tuple(UNITS)}", repr(self.units)),
            *complaint(self.pairing in PAIRINGS, "pairing", f"be one of {PAIRINGS}",
                       repr(self.pairing)),
            *check_positive("prior_scale", self.prior_scale),
            *complaint(mu is None or ((mu > 0) & (mu <= 1)), "forgetting",
                       "be above 0 and at most 1", self.forgetting),
            *complaint(0 < self.cutoff_hz < fs / 2, "cutoff_hz",
                       f"lie between 0 and half the sampling rate, {fs / 2:g} Hz", self.cutoff_hz),
            *check_positive("q", self.q),
            *complaint(own or fs == RATE, "start",
                       f"be given at {fs:g} Hz, since the published taps are {RATE:g} Hz apart",
                       "None"),
        ]  # fmt: skip
        if found:
            return found
        return replace(self, prior=prior() if self.prior is None else self.prior,
                       start=START if self.start is None else self.start).composed().problems(
                           benchmark)  # fmt: skip

    def prepare(self, benchmark):
        if self.q is None:
            estimator = DirectMeasurement()
        else:
            estimator = design_kalman(benchmark.plant_model, self.q, benchmark.r_mm2)
        scale = jnp.asarray(self.prior_scale, dtype=float)
        P = jnp.asarray(prior() * UNITS[self.units] if self.prior is None else self.prior)
        if scale.ndim:  # one factor a trial
            P = P[..., None] * scale[None, None, None]
        else:
            P = P * scale
        return replace(
            self,
            units="published",  # now in `prior`: designs that differ in numbers share a program
            prior_scale=jnp.ones(()),
            forgetting=jnp.asarray(self.forgetting, dtype=float),
            prior=P,
            start=jnp.asarray(START if self.start is None else self.start, dtype=float),
            fs=float(benchmark.fs),
            estimator=estimator,
        )

    def frozen(self, benchmark, coefficients):
        """The same filters with (4, 2) or (4, 2, T) taps that stay."""
        return self.prepare(benchmark).composed().frozen(benchmark, coefficients)

    def init(self, trials):
        return self.composed().init(trials)

    def step(self, state, seen):
        whole = self.composed()
        if self.pairing == "previous":
            state, decision = whole.step(state, seen)
            return state, replace(decision, signals={"C_A": decision.signals["C_A"]})
        taught, _, phi = whole.taught(state["taught"], seen.x_m, seen.x_hat)
        target, q = whole.regressor.step(state["target"], seen.x_a)
        b0, memory = whole.low_pass.b[0], state["heard"]
        columns, fits, commands = [], [], []
        for part in whole.parts:
            i = part.number
            theta = tuple(row[i] for row in state["coefficients"])
            # With taps of nought the correction is g times the value 1: it is the gain itself.
            unit = Pair(seen.k, seen.dt, phi[i], [jnp.ones_like(theta[0])])
            nothing = tuple((jnp.zeros_like(t),) for t in theta)
            P, gain = whole.fit.step(state["fits"][i], part, unit, nothing, None)
            g = [row[0] for row in gain.coefficients]
            theta, u = solve_loop(theta, g, phi[i], q[i], b0, memory[0][i])
            columns.append(theta)
            fits.append(P)
            commands.append(u)
        u = jnp.stack(commands)
        heard, _ = whole.low_pass.step(memory, u)
        coefficients = tuple(zip(*columns, strict=True))
        state = state | {
            "coefficients": coefficients, "fits": tuple(fits), "taught": taught, "target": target,
            "command": tuple(commands), "heard": heard,
        }  # fmt: skip
        signals = {"C_A": jnp.stack([jnp.stack(row) for row in coefficients])}
        return state, Decision(u=u, signals=signals)


def solve_loop(theta, g, phi, q, b0, h) -> tuple[tuple, jax.Array]:
    """Taps and command of an actuator that depend on each other, see ``RoDeAC``.

    Args:
        theta: taps (T,) before the sample.
        g: gain (T,) an unknown.
        phi, q: regressors (T,) of the measurement and of the target.
        b0, h: the filtered command is b0 u(k) + h.

    Returns:
        taps (T,) after the sample; command u(k) (T,) [mm].
    """
    dot = lambda a, b: sum(x * y for x, y in zip(a, b, strict=True))  # noqa: E731
    error = h - dot(phi, theta)
    u = (dot(theta, q) + dot(g, q) * error) / (1.0 - b0 * dot(g, q))
    return tuple(t + x * (error + b0 * u) for t, x in zip(theta, g, strict=True)), u


ENTRY = Entry(
    name="rodeac",
    controller=RoDeAC,
    label="RoDeAC",
    paper="Quiroz, Galmez & Fermandois 2024, Front. Built Environ. 10:1394952",
    parameters=(
        Parameter("units", "", "unit that P_0 is used in", "published", choices=tuple(UNITS),
                  kind="static"),
        Parameter("prior_scale", "", "factor of P_0", 1.0, "1", 0.0, above=True, kind="tunable"),
        Parameter("forgetting", "mu", "forgetting factor", 1.0, "1", 0.0, 1.0, above=True),
        Parameter("pairing", "", "command that goes with a sample's strokes", "same",
                  choices=PAIRINGS, kind="static"),
        Parameter("cutoff_hz", "f_c", "corner of the low-pass", 20.0, "Hz", 0.0, above=True,
                  kind="static"),
        Parameter("q", "q", "process noise", None, "mm^2", 0.0, above=True, kind="static"),
    ),
)  # fmt: skip
