"""Inverse of a transfer function that an unscented Kalman filter estimates (Ruiz & Song 2024)."""

from __future__ import annotations

from dataclasses import dataclass

import jax

from martths_jax.control.adaptive.actuator import TransferFunction
from martths_jax.control.controllers.joint_filters import ALPHA, Unscented
from martths_jax.control.controllers.parameter_filter import PARAMETERS_OF_ALL, signals_of
from martths_jax.control.entry import Entry

MODEL = TransferFunction()


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class UKFTF(Unscented):
    """``ParameterFilter`` of x_i = (u_i + c u_j) / (p_2 s^2 + p_1 s + p_0)."""

    actuators_needed = 2
    name = "ukf-tf"
    model = MODEL
    signals = signals_of(MODEL)


ENTRY = Entry(
    name="ukf-tf",
    controller=UKFTF,
    label="UKF-TF",
    paper="after Ruiz & Song 2024, Front. Built Environ. 10:1477804",
    parameters=(*PARAMETERS_OF_ALL, ALPHA),
)
