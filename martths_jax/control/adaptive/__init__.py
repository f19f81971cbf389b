"""The pieces of adaptive controllers, each exchangeable: one file a family, one line here."""

from martths_jax.control.adaptive.base import Fit, Fitted, Guard, Law, Pair, Part, Regressor
from martths_jax.control.adaptive.differences import BackwardDifferences
from martths_jax.control.adaptive.fading import Fading
from martths_jax.control.adaptive.gradient import NormalisedGradient
from martths_jax.control.adaptive.guards import (
    Bounds,
    ConditionGate,
    ExcitationGate,
    MotionThreshold,
    NoiseRemoval,
    Pull,
    PullToLast,
    RateLimit,
    ShapedPull,
    noise_covariance,
)
from martths_jax.control.adaptive.law import Linear
from martths_jax.control.adaptive.lowpass import LowPass, butterworth
from martths_jax.control.adaptive.recursive import RandomWalk, Recursive
from martths_jax.control.adaptive.taps import TapMap, fir
from martths_jax.control.adaptive.weighted import WeightedWindow
from martths_jax.control.adaptive.window import Window

__all__ = [
    "BackwardDifferences",
    "Bounds",
    "ConditionGate",
    "ExcitationGate",
    "Fading",
    "Fit",
    "Fitted",
    "Guard",
    "Law",
    "Linear",
    "LowPass",
    "MotionThreshold",
    "NoiseRemoval",
    "NormalisedGradient",
    "Pair",
    "Part",
    "Pull",
    "PullToLast",
    "RandomWalk",
    "RateLimit",
    "Recursive",
    "Regressor",
    "ShapedPull",
    "TapMap",
    "WeightedWindow",
    "Window",
    "butterworth",
    "fir",
    "noise_covariance",
]
