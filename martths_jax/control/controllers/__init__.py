"""Controllers: passthrough, LQG and ADFC, behind one protocol (see ``base``)."""

from martths_jax.control.base import Controller, Decision, Observation
from martths_jax.control.controllers.adfc import ADFC
from martths_jax.control.controllers.lqg import LQG
from martths_jax.control.controllers.passthrough import Passthrough

__all__ = ["ADFC", "LQG", "Controller", "Decision", "Observation", "Passthrough"]
