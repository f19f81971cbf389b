"""Controllers, one file each with its ``ENTRY``; ``ENTRIES`` lists them."""

from martths_jax.control.base import Controller, Decision, Observation
from martths_jax.control.controllers import (
    adfc,
    adfc_akf,
    adfc_rls,
    adfc_weighted,
    aic,
    amb,
    ats,
    ats_rls,
    cats_mpc,
    cats_pid,
    decoupling,
    derivative_ff,
    ekf_ss,
    ekf_tf,
    error_model,
    inverse,
    lqg,
    mff,
    mff_lqg,
    network_inverse,
    ning_ff_fb,
    passthrough,
    phase_lead,
    pi_lead,
    polynomial,
    polynomial_darby,
    polynomial_wallace,
    rodeac,
    sliding_adm,
    sliding_switching,
    three_variable,
    two_stage,
    ukf_ss,
    ukf_tf,
)
from martths_jax.control.controllers.adfc import ADFC
from martths_jax.control.controllers.adfc_akf import AdaptiveFilterADFC
from martths_jax.control.controllers.adfc_rls import RecursiveADFC
from martths_jax.control.controllers.adfc_weighted import WeightedADFC
from martths_jax.control.controllers.aic import AIC
from martths_jax.control.controllers.amb import AMB
from martths_jax.control.controllers.ats import ATS
from martths_jax.control.controllers.ats_rls import RecursiveATS
from martths_jax.control.controllers.cats_mpc import CATSMPC
from martths_jax.control.controllers.cats_pid import CATSPID
from martths_jax.control.controllers.decoupling import Decoupling
from martths_jax.control.controllers.derivative_ff import DerivativeFeedforward
from martths_jax.control.controllers.ekf_ss import EKFSS
from martths_jax.control.controllers.ekf_tf import EKFTF
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
from martths_jax.control.controllers.pi_lead import LeadAndPI
from martths_jax.control.controllers.polynomial import Polynomial
from martths_jax.control.controllers.polynomial_darby import PolynomialDarby
from martths_jax.control.controllers.polynomial_wallace import PolynomialWallace
from martths_jax.control.controllers.rodeac import RoDeAC
from martths_jax.control.controllers.sliding_adm import SlidingADM
from martths_jax.control.controllers.sliding_switching import SlidingSwitching
from martths_jax.control.controllers.three_variable import ThreeVariable
from martths_jax.control.controllers.two_stage import TwoStage
from martths_jax.control.controllers.ukf_ss import UKFSS
from martths_jax.control.controllers.ukf_tf import UKFTF

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
    pi_lead.ENTRY,
    cats_pid.ENTRY,
    cats_mpc.ENTRY,
    ekf_tf.ENTRY,
    ukf_tf.ENTRY,
    ekf_ss.ENTRY,
    ukf_ss.ENTRY,
    adfc_akf.ENTRY,
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
    "CATSMPC",
    "CATSPID",
    "EKFSS",
    "EKFTF",
    "ENTRIES",
    "LQG",
    "MFF",
    "MFFLQG",
    "UKFSS",
    "UKFTF",
    "AdaptiveFeedforward",
    "AdaptiveFilterADFC",
    "Controller",
    "Decision",
    "Decoupling",
    "DerivativeFeedforward",
    "ErrorModel",
    "FrozenFeedforward",
    "Inverse",
    "LeadAndPI",
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
