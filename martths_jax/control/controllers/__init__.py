"""Controllers, one file each with its ``ENTRY``; ``ENTRIES`` lists them."""

from martths_jax.control.base import Controller, Decision, Observation
from martths_jax.control.controllers import (
    adfc,
    adfc_rls,
    adfc_weighted,
    aic,
    ats,
    ats_rls,
    error_model,
    lqg,
    passthrough,
)
from martths_jax.control.controllers.adfc import ADFC
from martths_jax.control.controllers.feedforward import AdaptiveFeedforward
from martths_jax.control.controllers.frozen import FrozenFeedforward
from martths_jax.control.controllers.lqg import LQG
from martths_jax.control.controllers.passthrough import Passthrough

#: What can be named without a path, in the order of help texts.
ENTRIES = (
    lqg.ENTRY,
    adfc.ENTRY,
    passthrough.ENTRY,
    ats.ENTRY,
    ats_rls.ENTRY,
    aic.ENTRY,
    error_model.ENTRY,
    adfc_rls.ENTRY,
    adfc_weighted.ENTRY,
)

__all__ = [
    "ADFC",
    "ENTRIES",
    "LQG",
    "AdaptiveFeedforward",
    "Controller",
    "Decision",
    "FrozenFeedforward",
    "Observation",
    "Passthrough",
]
