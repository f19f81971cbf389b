"""Feedforward of a discrete model, and feedback so that the model matters less (after Ning et al.).

    u(k) = u_ff(k) + k_P (x_a(k) - x_f(k)) + k_I sum dt (x_a - x_m)

u_ff is ``mff``, a discrete model of the nominal plant's inverse in the last samples of both
strokes.  It is applied to 2 x_a(k) - x_a(k-1), the target of k + 1, when u(k) is first felt.  x_f
comes from a Kalman filter of its own, quicker than the one whose strokes make the force, which
trusts the nominal plant too much to see another.  The integral averages noise by itself and takes
the measured strokes, which no model biases.  Nothing adapts.

Architecture from abstracts; the equations, the target one sample ahead and the gains are choices of
this project.  Feedback through the inverse, which would lead e as the targets are led, makes the
loop unstable.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from types import MappingProxyType

import jax
import jax.numpy as jnp
import numpy as np

from martths_jax.control.adaptive.arguments import check_positive, complaint, known
from martths_jax.control.base import Decision, Signal
from martths_jax.control.controllers.mff import FIT, MFF, PROCESS_NOISE
from martths_jax.control.controllers.sliding_adm import largest_pole
from martths_jax.control.entry import Entry, Parameter
from martths_jax.control.estimators import KalmanFilter, design_kalman
from martths_jax.structure.modal import to_dense

#: k_P [-] and k_I [1/s].  On 64 drawn plants the largest errors fall with k_P; with 2 the loops of
#: four of them bear an extra delay of 22 ms.
FEEDBACK, INTEGRAL = 2.0, 1.0
#: Process noise of the feedback's filter [mm^2].
Q_FB = 0.03


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class NingFFFB(MFF):
    """The equations above on top of ``MFF``.

    Attributes:
        feedback: k_P [-].
        integral: k_I [1/s].
        q_fb: process noise of the feedback's filter [mm^2].
        observer: that filter, designed by ``prepare``.

    The other attributes are those of ``MFF``.
    """

    order: int = field(default=2, metadata={"static": True})
    feedback: jax.Array | float = FEEDBACK
    integral: jax.Array | float = INTEGRAL
    q_fb: jax.Array | float = Q_FB
    observer: KalmanFilter | None = None

    actuators_needed = 2
    name = "ning-ff-fb"
    signals = (Signal("u_fb", ("actuator",), "mm", "command of the feedback", elements=("1", "2")),)
    shared_axes = MappingProxyType({**MFF.shared_axes, "feedback": 0, "integral": 0, "q_fb": 0})

    def problems(self, benchmark):
        found = [
            *super().problems(benchmark),
            *check_positive("feedback", self.feedback, zero=True),
            *check_positive("integral", self.integral, zero=True),
            *check_positive("q_fb", self.q_fb),
        ]
        gains = known(self.feedback), known(self.integral)
        if found or any(gain is None for gain in gains):
            return found
        C = to_dense(benchmark.plant_model)[2]
        pairs = np.broadcast_arrays(*gains)
        size = max(
            largest_pole(benchmark, p * C, i * np.eye(2))
            for p, i in zip(*(x.ravel() for x in pairs), strict=True)
        )
        # Without integral its sum is a state of its own, which stays.
        good = size < 1 or (not gains[1].any() and size < 1 + 1e-9)
        return complaint(good, "feedback, integral", "give feedback that is stable on the nominal "
                         "plant", f"a pole of magnitude {size:.4g}")  # fmt: skip

    def prepare(self, benchmark):
        return replace(
            super().prepare(benchmark),
            feedback=jnp.asarray(self.feedback, dtype=float),
            integral=jnp.asarray(self.integral, dtype=float),
            observer=design_kalman(benchmark.plant_model, self.q_fb, benchmark.r_mm2),
        )

    def init(self, trials):
        zero = jnp.zeros((2, trials))
        return {
            "before": zero,  # x_a(k-1)
            "ahead": super().init(trials),
            "predicted": self.observer.init(trials),
            "sum": zero,
        }

    def step(self, state, seen):
        target = 2.0 * seen.x_a - state["before"]
        ahead, led = super().step(state["ahead"], replace(seen, x_a=target))
        z, x_f = self.observer.correct(state["predicted"], seen.x_m)
        summed = state["sum"] + seen.dt * (seen.x_a - seen.x_m)
        fed_back = self.feedback * (seen.x_a - x_f) + self.integral * summed
        u = led.u + fed_back
        state = {
            "before": seen.x_a,
            "ahead": ahead,
            "predicted": self.observer.predict(z, u),
            "sum": summed,
        }
        return state, Decision(u=u, signals={"u_fb": fed_back})


ENTRY = Entry(
    name="ning-ff-fb",
    controller=NingFFFB,
    label="Ning FF + FB",
    paper="after Ning et al., feedforward of a discrete model and feedback",
    parameters=(
        replace(FIT[0], default=2),
        *FIT[1:],
        Parameter("feedback", "k_P", "proportional gain of the feedback", FEEDBACK, "1", 0.0),
        Parameter("integral", "k_I", "integral gain of the feedback", INTEGRAL, "1/s", 0.0),
        Parameter("q_fb", "q_fb", "process noise of the feedback's filter", Q_FB, "mm^2", 0.0,
                  above=True),
        PROCESS_NOISE,
    ),
)  # fmt: skip
