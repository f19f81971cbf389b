"""Model-based feedforward with an LQG regulator of its error (Phillips & Spencer).

    u(k) = u_ff(k) + u_fb(k),   u_fb(k) = -K zeta_hat(k),   zeta = (dz, w)

The deviation e = x_m - x_a is what the plant makes of the feedback and of the feedforward's error,
and the sensors' noise:

    dz(k+1) = A dz(k) + B (u_fb(k) + w(k)),   w(k+1) = a w(k) + n(k),   e(k) = C dz(k) + v(k)

An error of the feedforward is about as slow as the motion; so w is white noise n through a low-pass
of first order, a = exp(-2 pi f_w dt).  K minimises the sum of |C dz|^2 + r |u_fb|^2; zeta_hat comes
from a steady-state Kalman filter of its own, beside the one whose strokes make the force.

What is chosen here: the cost knows w too, as the optimum for this model has it.  A regulator that
leaves w to the estimator (gain 0 on it) tracks less well at the same r.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import MappingProxyType

import jax
import jax.numpy as jnp
import numpy as np

from martths_jax.control.adaptive.arguments import check_positive, complaint, known
from martths_jax.control.base import Decision, Signal
from martths_jax.control.controllers.mff import FIT, MFF, PROCESS_NOISE, check_band
from martths_jax.control.entry import Entry, Parameter
from martths_jax.control.estimators.kalman import steady_state_gains
from martths_jax.structure.modal import ModalSystem, advance, contract, output, spread, to_dense

#: Weight of the feedback: spends little command, and does most of what a smaller one would.
R = 0.1
#: Standard deviation of the feedforward's error: a tenth of a command of 0.5 mm rms [mm].
SIGMA_MM = 0.05
#: Its corner, just at the structure's motion [Hz].
CORNER_HZ = 2.0


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class MFFLQG(MFF):
    """The equations above on top of ``MFF``.

    Attributes:
        r: weight of the feedback's command against the error's [-].
        sigma_mm: standard deviation of w, what the feedforward's command is in error by [mm].
        corner_hz: corner f_w of w [Hz].
        K_z: (2, 2, m) gain on dz, slot by slot; K_w: (2, 2) on w; by ``prepare``, as what follows.
        L_z: (2, m, 2) filter gain of dz, slot by slot; L_w: (2, 2) of w.
        pole: a above.
        model: nominal plant.

    The other attributes are those of ``MFF``.
    """

    r: jax.Array | float = R
    sigma_mm: jax.Array | float = SIGMA_MM
    corner_hz: jax.Array | float = CORNER_HZ
    K_z: jax.Array | None = None
    K_w: jax.Array | None = None
    L_z: jax.Array | None = None
    L_w: jax.Array | None = None
    pole: jax.Array | None = None
    model: ModalSystem | None = None

    name = "mff-lqg"
    actuators_needed = 2
    signals = (
        Signal("u_fb", ("actuator",), "mm", "command of the regulator", elements=("1", "2")),
    )
    shared_axes = MappingProxyType({
        **MFF.shared_axes, "r": 0, "sigma_mm": 0, "corner_hz": 0, "K_z": 3, "K_w": 2, "L_z": 3,
        "L_w": 2, "pole": 0,
    })  # fmt: skip

    def problems(self, benchmark):
        found = [*super().problems(benchmark), *check_band("corner_hz", self.corner_hz, benchmark)]
        for name in ("r", "sigma_mm", "corner_hz"):
            value = known(getattr(self, name))
            good = value is not None and value.ndim == 0
            found += complaint(good, name, "be one number, known before the run",
                               f"{getattr(self, name)!r:.80}")  # fmt: skip
            if name != "corner_hz":
                found += check_positive(name, getattr(self, name))
        return found

    def prepare(self, benchmark):
        A, B, C, _ = to_dense(benchmark.plant_model)
        n = len(A)
        a = np.exp(-2 * np.pi * float(self.corner_hz) * benchmark.dt)
        F = np.block([[A, B], [np.zeros((2, n)), a * np.eye(2)]])
        driven, error = np.eye(n + 2)[:, n:], np.hstack([C, np.zeros((2, 2))])
        commanded = np.vstack([B, np.zeros((2, 2))])
        L = steady_state_gains(
            F, driven, error, (1 - a**2) * float(self.sigma_mm) ** 2, benchmark.r_mm2
        )[0]
        # The regulator is the filter of the transposed system.
        K = steady_state_gains(F.T, error.T, commanded.T, 1.0, float(self.r))[1].T
        slots = lambda gain: np.swapaxes(gain.reshape(2, n // 2, 2), 1, 2)  # noqa: E731
        return replace(
            super().prepare(benchmark),
            K_z=jnp.asarray(slots(K[:, :n])),
            K_w=jnp.asarray(K[:, n:]),
            L_z=jnp.asarray(np.transpose(L[:n].reshape(n // 2, 2, 2), (1, 0, 2))),
            L_w=jnp.asarray(L[n:]),
            pole=jnp.asarray(a),
            model=benchmark.plant_model,
        )

    def init(self, trials):
        """Feedforward's memory; predictions of dz (2, m, T) and of w (2, T)."""
        slots = self.model.a.shape[:2]
        return super().init(trials), jnp.zeros((*slots, trials)), jnp.zeros((2, trials))

    def step(self, state, seen):
        kept, dz, w = state
        kept, ahead = super().step(kept, seen)
        innovation = seen.x_m - seen.x_a - output(self.model, dz)
        dz = dz + spread(self.L_z, innovation)
        w = w + contract(self.L_w, innovation)
        feedback = -contract(self.K_z, dz, axes=2) - contract(self.K_w, w)
        later = advance(self.model, dz, feedback + w), self.pole * w
        return (kept, *later), Decision(u=ahead.u + feedback, signals={"u_fb": feedback})


ENTRY = Entry(
    name="mff-lqg",
    controller=MFFLQG,
    label="MFF + LQG",
    paper="Phillips & Spencer 2013; Fermandois & Spencer 2017, feedforward and LQG regulator",
    parameters=(
        *FIT,
        Parameter("r", "r", "weight of the feedback", R, "1", 0.0, above=True),
        Parameter("sigma_mm", "sigma_w", "feedforward's error", SIGMA_MM, "mm", 0.0, above=True),
        Parameter("corner_hz", "f_w", "corner of that error", CORNER_HZ, "Hz", 0.0, above=True),
        PROCESS_NOISE,
    ),
)
