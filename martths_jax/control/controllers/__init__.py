"""Controllers, one file each with its ``ENTRY``; ``ENTRIES`` lists them."""

from martths_jax.control.base import Controller, Decision, Observation
from martths_jax.control.controllers import adfc, decoupling, lqg, mff, mff_lqg, passthrough, rodeac
from martths_jax.control.controllers.adfc import ADFC
from martths_jax.control.controllers.decoupling import Decoupling
from martths_jax.control.controllers.feedforward import AdaptiveFeedforward
from martths_jax.control.controllers.frozen import FrozenFeedforward
from martths_jax.control.controllers.lqg import LQG
from martths_jax.control.controllers.mff import MFF
from martths_jax.control.controllers.mff_lqg import MFFLQG
from martths_jax.control.controllers.passthrough import Passthrough
from martths_jax.control.controllers.rodeac import RoDeAC

#: What can be named without a path, in the order of help texts.
ENTRIES = (
    lqg.ENTRY,
    adfc.ENTRY,
    passthrough.ENTRY,
    rodeac.ENTRY,
    mff.ENTRY,
    mff_lqg.ENTRY,
    decoupling.ENTRY,
)

__all__ = [
    "ADFC",
    "ENTRIES",
    "LQG",
    "MFF",
    "MFFLQG",
    "AdaptiveFeedforward",
    "Controller",
    "Decision",
    "Decoupling",
    "FrozenFeedforward",
    "Observation",
    "Passthrough",
    "RoDeAC",
]
