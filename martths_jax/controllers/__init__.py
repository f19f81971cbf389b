"""Controllers: passthrough, LQG and ADFC, behind one protocol (see ``base``)."""

from martths_jax.controllers.adfc import ADFC
from martths_jax.controllers.base import Controller, Decision, Observation
from martths_jax.controllers.lqg import LQG
from martths_jax.controllers.passthrough import Passthrough

__all__ = ["ADFC", "LQG", "Controller", "Decision", "Observation", "Passthrough"]
