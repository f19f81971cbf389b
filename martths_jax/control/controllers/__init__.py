"""Controllers, one file each with its ``ENTRY``; ``ENTRIES`` lists them."""

from martths_jax.control.base import Controller, Decision, Observation
<<<<<<< HEAD
from martths_jax.control.controllers import (
    adfc,
    derivative_ff,
    inverse,
    lqg,
    mff,
    passthrough,
    phase_lead,
    polynomial,
    polynomial_darby,
    polynomial_wallace,
    rodeac,
)
from martths_jax.control.controllers.adfc import ADFC
from martths_jax.control.controllers.derivative_ff import DerivativeFeedforward
=======
from martths_jax.control.controllers import adfc, decoupling, lqg, mff, mff_lqg, passthrough, rodeac
from martths_jax.control.controllers.adfc import ADFC
from martths_jax.control.controllers.decoupling import Decoupling
>>>>>>> fam-d
from martths_jax.control.controllers.feedforward import AdaptiveFeedforward
from martths_jax.control.controllers.frozen import FrozenFeedforward
from martths_jax.control.controllers.inverse import Inverse
from martths_jax.control.controllers.lqg import LQG
from martths_jax.control.controllers.mff import MFF
from martths_jax.control.controllers.mff_lqg import MFFLQG
from martths_jax.control.controllers.passthrough import Passthrough
from martths_jax.control.controllers.phase_lead import PhaseLead
from martths_jax.control.controllers.polynomial import Polynomial
from martths_jax.control.controllers.polynomial_darby import PolynomialDarby
from martths_jax.control.controllers.polynomial_wallace import PolynomialWallace
from martths_jax.control.controllers.rodeac import RoDeAC

#: What can be named without a path, in the order of help texts.
ENTRIES = (
    lqg.ENTRY,
    adfc.ENTRY,
    passthrough.ENTRY,
<<<<<<< HEAD
    polynomial.ENTRY,
    phase_lead.ENTRY,
    derivative_ff.ENTRY,
    inverse.ENTRY,
    mff.ENTRY,
    rodeac.ENTRY,
    polynomial_wallace.ENTRY,
    polynomial_darby.ENTRY,
=======
    rodeac.ENTRY,
    mff.ENTRY,
    mff_lqg.ENTRY,
    decoupling.ENTRY,
>>>>>>> fam-d
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
<<<<<<< HEAD
    "DerivativeFeedforward",
=======
    "Decoupling",
>>>>>>> fam-d
    "FrozenFeedforward",
    "Inverse",
    "Observation",
    "Passthrough",
    "PhaseLead",
    "Polynomial",
    "PolynomialDarby",
    "PolynomialWallace",
    "RoDeAC",
]
