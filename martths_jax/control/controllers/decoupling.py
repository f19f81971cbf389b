"""Decoupling control: one compensator of gain and lead an actuator, and a matrix D.

    static:   u_i = g_i w_i + T_i w_i',   w = D x_a,   D = H(0)^-1
    dynamic:  u = D v,   v_i = g_i x_a,i + T_i x_a,i',   D = [[1, -H12/H11], [-H21/H22, 1]] S

The static D undoes what the frame does to the strokes at rest, and the leads act on commands, since
it is the actuators that lag.  The dynamic D takes the interaction out of the nominal plant, H D
diagonal, so that each stroke has a compensator of its own; S is diagonal and makes H D one at rest.
Of its quotients H12/H11 is proper and H21/H22 is not: each is taken by value and slope,
d_0 + d_1 s, fitted over a band.

After the idea of Najafi & Spencer; the equations are those of the method, not taken from a paper.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from martths_jax.control.adaptive.arguments import check_positive, complaint, known
from martths_jax.control.adaptive.differences import BackwardDifferences
from martths_jax.control.adaptive.inverse import NOISE_SHARE
from martths_jax.control.base import Controller, Decision
from martths_jax.control.controllers.mff import check_band
from martths_jax.control.entry import Entry, Parameter
from martths_jax.control.estimators import design_kalman
from martths_jax.structure.modal import ModalSystem, contract, to_dense

#: How D is realised.
FORMS = ("static", "dynamic")
#: Value and slope of a signal, of second order.
VALUE_AND_SLOPE = BackwardDifferences(order=1, accuracy=2)
#: Up to where is fitted [Hz], and how far down a dynamic fit may go: the second derivatives that
#: come of slope times lead are larger there, and the hybrid loop is unstable from 3 Hz downwards.
BAND_HZ, LOWEST_HZ = 4.0, 3.5
#: Frequencies of a fit.
POINTS = 400


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Decoupling(Controller):
    """The equations above; derivatives are backward differences of second order.

    Attributes:
        form: ``static`` or ``dynamic``.
        band_hz: what is fitted, is fitted up to here [Hz].
        lead_ms: (2,) leads T_i of compensators with gain one [ms]; None fits gain and lead of each
            to the inverse of its own channel, see ``channel_leads``.
        q: process noise of the Kalman filter [mm^2].
        D: (2, 2, 2) value and slope dt d_1 of D, made by ``prepare`` as what follows.
        lead: (2, 2) row j: g_i, then T_i / dt.
        estimator: the Kalman filter; the compensators do not use it.
    """

    form: str = field(default="dynamic", metadata={"static": True})
    band_hz: jax.Array | float = BAND_HZ
    lead_ms: jax.Array | tuple[float, float] | None = None
    q: jax.Array | float = 3e-5
    D: jax.Array | None = None
    lead: jax.Array | None = None
    estimator: Any = None

    name = "decoupling"
    actuators_needed = 2
    shared_axes = MappingProxyType({"band_hz": 0, "lead_ms": 1, "q": 0, "D": 3, "lead": 2})

    def problems(self, benchmark):
        found = [
            *complaint(self.form in FORMS, "form", f"be one of {FORMS}", repr(self.form)),
            *check_band("band_hz", self.band_hz, benchmark),
            *check_positive("q", self.q),
        ]
        if not found:
            found += complaint(np.ndim(self.band_hz) == 0, "band_hz", "be one number",
                               f"{self.band_hz!r:.80}")  # fmt: skip
        if not found and self.form == "dynamic":
            found += complaint(self.band_hz >= LOWEST_HZ, "band_hz",
                               f"be at least {LOWEST_HZ:g} Hz with a dynamic decoupling, whose "
                               "loop is unstable with narrower fits", self.band_hz)  # fmt: skip
        lead = known(self.lead_ms)
        if lead is not None:
            good = lead.shape == (2,) and np.all(np.isfinite(lead))
            found += complaint(good, "lead_ms", "be two numbers (ms)", f"{self.lead_ms!r:.80}")
        return found

    def prepare(self, benchmark):
        model, fs, band = benchmark.plant_model, benchmark.fs, float(self.band_hz)
        D = decoupler(model, fs, band, dynamic=self.form == "dynamic")
        if self.lead_ms is None:
            lead = jnp.asarray(channel_leads(model, fs, band, D))
        else:
            slope = jnp.asarray(self.lead_ms, dtype=float) * (1e-3 * fs)
            lead = jnp.stack([jnp.ones(2), slope])
        return replace(
            self,
            lead_ms=None,  # now in `lead`
            D=jnp.asarray(D),
            lead=lead,
            estimator=design_kalman(benchmark.plant_model, self.q, benchmark.r_mm2),
        )

    def init(self, trials):
        """Memory of what D takes, where it has slopes, and of what the compensators take."""
        first = VALUE_AND_SLOPE.init(trials) if self.form == "dynamic" else ()
        return first, VALUE_AND_SLOPE.init(trials)

    def step(self, state, seen):
        first, second = state
        if self.form == "static":
            second, u = self._compensate(second, contract(self.D[0], seen.x_a))
            return (first, second), Decision(u=u)
        second, v = self._compensate(second, seen.x_a)
        first, phi = VALUE_AND_SLOPE.step(first, v)
        value, slope = (jnp.stack([p[j] for p in phi]) for j in (0, 1))
        u = contract(self.D[1], slope, start=contract(self.D[0], value))
        return (first, second), Decision(u=u)

    def _compensate(self, memory, x):
        """Memory, and what the compensators make of two signals (2, T)."""
        memory, phi = VALUE_AND_SLOPE.step(memory, x)
        rows = [self.lead[0, i] * p + self.lead[1, i] * d for i, (p, d) in enumerate(phi)]
        return memory, jnp.stack(rows)


def responses(model: ModalSystem, fs: float, z: np.ndarray) -> np.ndarray:
    """(points, stroke, command) response of a plant at points z of the unit circle."""
    A, B, C, _ = to_dense(model)
    return C @ np.linalg.solve(z[:, None, None] * np.eye(len(A)) - A, B)


def circle(fs: float, band_hz: float) -> np.ndarray:
    """Evenly spaced points of the unit circle, above rest and up to a band."""
    return np.exp(2j * np.pi * np.linspace(0, band_hz, POINTS + 1)[1:] / fs)


def value_and_slope(z: np.ndarray) -> np.ndarray:
    """(points, 2) what a unit signal and its backward difference are there."""
    matrix = VALUE_AND_SLOPE.matrix
    return z[:, None] ** -np.arange(matrix.shape[1]) @ matrix.T


def decoupler(model: ModalSystem, fs: float, band_hz: float, *, dynamic: bool) -> np.ndarray:
    """D that leaves least interaction in the strokes.

        min sum |H_ii (d_0 + d_1 s) + H_ij|^2  over the band,  d_0 = -H_ij(0)/H_ii(0) if static

    Args:
        model: plant, shared by all trials.
        fs: sampling rate [Hz].
        band_hz: of the fit [Hz].
        dynamic: whether there is a slope.

    Returns:
        (2, 2, 2): value, then dt times slope, so that H D is one on the diagonal at rest.
    """
    z, rest = circle(fs, band_hz), responses(model, fs, np.ones(1))[0].real
    H, phi = responses(model, fs, z), value_and_slope(z)
    D = np.stack([np.eye(2), np.zeros((2, 2))])
    for i, j in ((0, 1), (1, 0)):
        if dynamic:
            D[:, i, j] = _real_fit(H[:, i, i, None] * phi, -H[:, i, j])
        else:
            D[0, i, j] = -rest[i, j] / rest[i, i]
    return D / np.diag(rest @ D[0])


def channel_leads(model: ModalSystem, fs: float, band_hz: float, D: np.ndarray) -> np.ndarray:
    """Gains and leads that invert the channels of the decoupled plant.

    With c = H D v, or c = D H v where D is static, they minimise for white inputs v the mean square
    of v_i(k-1) - (g_i + T_i s) c_i(k) over the band, what is left of interaction and the white
    noise that ``nominal_inverse`` counts on included.

    Args:
        model, fs, band_hz: as in ``decoupler``.
        D: what it gives.

    Returns:
        (2, 2): gains, then leads in samples.
    """
    z = circle(fs, band_hz)
    H, phi = responses(model, fs, z), value_and_slope(z)
    # What each channel makes of both inputs, of which its own is to be given back.
    channels = D[0] @ H if not D[1].any() else H @ np.einsum("pd,dij->pij", phi, D)
    noise = np.sqrt(POINTS * NOISE_SHARE) * VALUE_AND_SLOPE.matrix.T
    columns = []
    for i, own in enumerate(np.eye(2)):
        rows = channels[:, i, :, None] * phi[:, None]
        columns.append(_real_fit(rows.reshape(-1, 2), np.kron(1 / z, own), noise))
    return np.stack(columns, axis=-1)


def _real_fit(rows: np.ndarray, values: np.ndarray, more: np.ndarray | None = None) -> np.ndarray:
    """Real numbers c with rows @ c next to complex values, and `more` @ c next to nought."""
    more = np.zeros((0, rows.shape[1])) if more is None else more
    left = np.concatenate([rows.real, rows.imag, more])
    right = np.concatenate([values.real, values.imag, np.zeros(len(more))])
    return np.linalg.lstsq(left, right)[0]


ENTRY = Entry(
    name="decoupling",
    controller=Decoupling,
    label="Decoupling",
    paper="Najafi & Spencer, decoupled compensation of several actuators",
    parameters=(
        Parameter("form", "", "how the interaction is undone", "dynamic", choices=FORMS,
                  kind="static"),
        Parameter("band_hz", "f_b", "band of the fits", BAND_HZ, "Hz", 0.0, above=True),
        Parameter("lead_ms", "T", "leads of compensators of gain one", None, "ms", size=2),
        Parameter("q", "q", "process noise", 3e-5, "mm^2", 0.0, above=True, kind="tunable"),
    ),
)  # fmt: skip
