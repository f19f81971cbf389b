"""Guards of an identification, one file a family."""

from martths_jax.control.adaptive.guards.gates import (
    ConditionGate,
    ExcitationGate,
    MotionThreshold,
)
from martths_jax.control.adaptive.guards.limits import Bounds, RateLimit
from martths_jax.control.adaptive.guards.noise import NoiseRemoval, noise_covariance
from martths_jax.control.adaptive.guards.pulls import Pull, PullToLast, ShapedPull

__all__ = [
    "Bounds",
    "ConditionGate",
    "ExcitationGate",
    "MotionThreshold",
    "NoiseRemoval",
    "Pull",
    "PullToLast",
    "RateLimit",
    "ShapedPull",
    "noise_covariance",
]
