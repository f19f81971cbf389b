"""Three-variable control: displacement, velocity and acceleration are fed forward and back.

    u(k) = k_x x_a + k_v v_a + k_a a_a - (g_x x_hat + g_v v_hat + g_a a_hat)

The feedback moves the poles of the loop, the feedforward inverts what has become of it.  With the
state z_hat of a Kalman filter on the nominal plant z' = A z + B u, x = C z,

    v_hat = C A z_hat,   a_hat = C A^2 z_hat + C A B u(k-1),

exactly, since C B = 0.  g are numbers an actuator; k_x, k_v, k_a are (2, 2) matrices on backward
differences, fitted over a band to the inverse of the closed loop on the nominal plant, as ``mff``
fits them to that of the plant.  Without feedback it is ``mff`` of order 2.

What is chosen here: the filter of the feedback is its own, beside the one whose strokes make the
force, and quicker.  That one trusts the nominal plant so much that feedback of its state hardly
differs from feedforward.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from types import MappingProxyType

import jax
import jax.numpy as jnp
import numpy as np

from martths_jax.control.adaptive.arguments import check_positive, complaint, known
from martths_jax.control.adaptive.inverse import dense_inverse
from martths_jax.control.base import Decision, Signal
from martths_jax.control.controllers.mff import FIT, MFF, PROCESS_NOISE
from martths_jax.control.entry import Entry, Parameter
from martths_jax.control.estimators import KalmanFilter, design_kalman
from martths_jax.structure.modal import contract, to_dense

#: On x_hat [-]: the plant's slow poles become four or five times as fast, and what is uncertain of
#: them counts as much less.  On v_hat [s] and a_hat [s^2]: damping, little of it, as they carry the
#: noise.  The loops of four drawn plants bear an extra delay of 90 ms with these, and of 24 ms
#: without that on a_hat.
G_X, G_V, G_A = (4.0, 3.0), (0.02, 0.01), (2e-5, 2e-5)
#: Process noise of the feedback's filter [mm^2]: much less and it sees no plant but the nominal
#: one, much more and its derivatives are noise.
Q_FB = 0.03


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class ThreeVariable(MFF):
    """The equations above on top of ``MFF``.

    Attributes:
        g_x, g_v, g_a: (2,) gains on displacement [-], velocity [s] and acceleration [s^2].
        q_fb: process noise of the filter that these come from [mm^2].
        K_z: (2, 2, m) gain on z_hat, slot by slot; K_u: (2, 2) on u(k-1); by ``prepare``.
        observer: the filter, designed by ``prepare``.

    The other attributes are those of ``MFF``.
    """

    order: int = field(default=2, metadata={"static": True})
    g_x: jax.Array | tuple[float, float] = G_X
    g_v: jax.Array | tuple[float, float] = G_V
    g_a: jax.Array | tuple[float, float] = G_A
    q_fb: jax.Array | float = Q_FB
    K_z: jax.Array | None = None
    K_u: jax.Array | None = None
    observer: KalmanFilter | None = None

    actuators_needed = 2
    name = "three-variable"
    signals = (Signal("u_fb", ("actuator",), "mm", "command of the feedback", elements=("1", "2")),)
    shared_axes = MappingProxyType({
        **MFF.shared_axes, "g_x": 1, "g_v": 1, "g_a": 1, "q_fb": 0, "K_z": 3, "K_u": 2,
    })  # fmt: skip

    def problems(self, benchmark):
        found = [*super().problems(benchmark), *check_positive("q_fb", self.q_fb)]
        for name in ("g_x", "g_v", "g_a"):
            value = known(getattr(self, name))
            good = value is not None and value.shape == (2,) and np.all(np.isfinite(value))
            found += complaint(good, name, "be two numbers, known before the run",
                               f"{getattr(self, name)!r:.80}")  # fmt: skip
        band = known(self.band_hz)
        if not found:
            found = complaint(band.ndim == 0, "band_hz", "be one number", f"{self.band_hz!r:.80}")
        if not found:
            poles = np.linalg.eigvals(self.closed_loop(benchmark)[0])
            found = complaint(np.abs(poles).max() < 1, "g_x, g_v, g_a",
                              "give feedback that is stable on the nominal plant",
                              f"a pole of magnitude {np.abs(poles).max():.4g}")  # fmt: skip
        return found

    def gains(self, benchmark) -> tuple[np.ndarray, np.ndarray]:
        """(2, n) gain on the plant's state and (2, 2) on the last command."""
        A, B, C = benchmark.plant_continuous
        g_x, g_v, g_a = (np.diag(np.asarray(g, float)) for g in (self.g_x, self.g_v, self.g_a))
        return g_x @ C + g_v @ C @ A + g_a @ C @ A @ A, g_a @ C @ A @ B

    def closed_loop(self, benchmark) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(A, B, C) of the nominal plant with the feedback, whose filter then has no error.

        The state is (z, u(k-1)), the input what is fed forward, the output the strokes.
        """
        A, B, C, _ = to_dense(benchmark.plant_model)
        K_z, K_u = self.gains(benchmark)
        return (
            np.block([[A - B @ K_z, -B @ K_u], [-K_z, -K_u]]),
            np.vstack([B, np.eye(2)]),
            np.hstack([C, np.zeros((2, 2))]),
        )

    def prepare(self, benchmark):
        coefficients = dense_inverse(
            self.closed_loop(benchmark),
            benchmark.fs,
            self.regressor.matrix,
            band_hz=float(self.band_hz),
        )
        K_z, K_u = self.gains(benchmark)
        return replace(
            super().prepare(benchmark),
            coefficients=jnp.asarray(coefficients),
            K_z=jnp.asarray(np.swapaxes(K_z.reshape(2, -1, 2), 1, 2)),
            K_u=jnp.asarray(K_u),
            observer=design_kalman(benchmark.plant_model, self.q_fb, benchmark.r_mm2),
        )

    def init(self, trials):
        """Memory of the feedforward, prediction of the feedback's filter, and u(k-1)."""
        return super().init(trials), self.observer.init(trials), jnp.zeros((2, trials))

    def step(self, state, seen):
        kept, predicted, before = state
        kept, ahead = super().step(kept, seen)
        z, _ = self.observer.correct(predicted, seen.x_m)
        feedback = -contract(self.K_z, z, axes=2) - contract(self.K_u, before)
        u = ahead.u + feedback
        return (kept, self.observer.predict(z, u), u), Decision(u=u, signals={"u_fb": feedback})


ENTRY = Entry(
    name="three-variable",
    controller=ThreeVariable,
    label="Three-variable",
    paper="after Tian et al., feedforward and feedback of displacement, velocity, acceleration",
    parameters=(
        replace(FIT[0], default=2),
        *FIT[1:],
        Parameter("g_x", "g_x", "feedback of displacement", G_X, "1", size=2),
        Parameter("g_v", "g_v", "feedback of velocity", G_V, "s", size=2),
        Parameter("g_a", "g_a", "feedback of acceleration", G_A, "s^2", size=2),
        Parameter("q_fb", "q_fb", "process noise of the feedback's filter", Q_FB, "mm^2", 0.0,
                  above=True),
        PROCESS_NOISE,
    ),
)  # fmt: skip
