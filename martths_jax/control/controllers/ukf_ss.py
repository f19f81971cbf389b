"""Inverse of a discrete state space that an unscented filter estimates (Ruiz & Song 2024)."""

from __future__ import annotations

from dataclasses import dataclass

import jax

from martths_jax.control.adaptive.actuator import StateSpace
from martths_jax.control.controllers.joint_filters import ALPHA, Unscented
from martths_jax.control.controllers.parameter_filter import PARAMETERS_OF_ALL, signals_of
from martths_jax.control.entry import Entry

MODEL = StateSpace()


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class UKFSS(Unscented):
    """``ParameterFilter`` of x(k+1) = (1 + phi - e) x(k) - phi x(k-1) + g u_i(k) + h u_j(k)."""

    actuators_needed = 2
    name = "ukf-ss"
    model = MODEL
    signals = signals_of(MODEL)


ENTRY = Entry(
    name="ukf-ss",
    controller=UKFSS,
    label="UKF-SS",
    paper="after Ruiz & Song 2024, Front. Built Environ. 10:1477804",
    parameters=(*PARAMETERS_OF_ALL, ALPHA),
)
