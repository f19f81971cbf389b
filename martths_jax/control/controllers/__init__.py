"""Controllers, one file each with its ``ENTRY``; ``ENTRIES`` lists them."""

from martths_jax.control.base import Controller, Decision, Observation
from martths_jax.control.controllers import (
    adfc,
    adfc_rls,
    adfc_weighted,
    aic,
    amb,
    ats,
    ats_rls,
    decoupling,
    derivative_ff,
    error_model,
    inverse,
    lqg,
    mff,
    mff_lqg,
    network_inverse,
    ning_ff_fb,
    passthrough,
    phase_lead,
    polynomial,
    polynomial_darby,
    polynomial_wallace,
    rodeac,
    sliding_adm,
    sliding_switching,
    three_variable,
    two_stage,
)
from martths_jax.control.controllers.adfc import ADFC
from martths_jax.control.controllers.adfc_rls import RecursiveADFC
from martths_jax.control.controllers.adfc_weighted import WeightedADFC
from martths_jax.control.controllers.aic import AIC
from martths_jax.control.controllers.amb import AMB
from martths_jax.control.controllers.ats import ATS
from martths_jax.control.controllers.ats_rls import RecursiveATS
from martths_jax.control.controllers.decoupling import Decoupling
from martths_jax.control.controllers.derivative_ff import DerivativeFeedforward
from martths_jax.control.controllers.error_model import ErrorModel
from martths_jax.control.controllers.feedforward import AdaptiveFeedforward
from martths_jax.control.controllers.frozen import FrozenFeedforward
from martths_jax.control.controllers.inverse import Inverse
from martths_jax.control.controllers.lqg import LQG
from martths_jax.control.controllers.mff import MFF
from martths_jax.control.controllers.mff_lqg import MFFLQG
from martths_jax.control.controllers.network_inverse import NetworkInverse
from martths_jax.control.controllers.ning_ff_fb import NingFFFB
from martths_jax.control.controllers.passthrough import Passthrough
from martths_jax.control.controllers.phase_lead import PhaseLead
from martths_jax.control.controllers.polynomial import Polynomial
from martths_jax.control.controllers.polynomial_darby import PolynomialDarby
from martths_jax.control.controllers.polynomial_wallace import PolynomialWallace
from martths_jax.control.controllers.rodeac import RoDeAC
from martths_jax.control.controllers.sliding_adm import SlidingADM
from martths_jax.control.controllers.sliding_switching import SlidingSwitching
from martths_jax.control.controllers.three_variable import ThreeVariable
from martths_jax.control.controllers.two_stage import TwoStage

#: What can be named without a path, in the order of help texts.
ENTRIES = (
    lqg.ENTRY,
    adfc.ENTRY,
    passthrough.ENTRY,
    polynomial.ENTRY,
    polynomial_wallace.ENTRY,
    polynomial_darby.ENTRY,
    phase_lead.ENTRY,
    derivative_ff.ENTRY,
    inverse.ENTRY,
    aic.ENTRY,
    mff.ENTRY,
    mff_lqg.ENTRY,
    decoupling.ENTRY,
    ats.ENTRY,
    ats_rls.ENTRY,
    rodeac.ENTRY,
    error_model.ENTRY,
    adfc_rls.ENTRY,
    adfc_weighted.ENTRY,
    amb.ENTRY,
    two_stage.ENTRY,
    three_variable.ENTRY,
    sliding_adm.ENTRY,
    sliding_switching.ENTRY,
    ning_ff_fb.ENTRY,
    network_inverse.ENTRY,
)

__all__ = [
    "ADFC",
    "AIC",
    "AMB",
    "ATS",
    "ENTRIES",
    "LQG",
    "MFF",
    "MFFLQG",
    "AdaptiveFeedforward",
    "Controller",
    "Decision",
    "Decoupling",
    "DerivativeFeedforward",
    "ErrorModel",
    "FrozenFeedforward",
    "Inverse",
    "NetworkInverse",
    "NingFFFB",
    "Observation",
    "Passthrough",
    "PhaseLead",
    "Polynomial",
    "PolynomialDarby",
    "PolynomialWallace",
    "RecursiveADFC",
    "RecursiveATS",
    "RoDeAC",
    "SlidingADM",
    "SlidingSwitching",
    "ThreeVariable",
    "TwoStage",
    "WeightedADFC",
]
