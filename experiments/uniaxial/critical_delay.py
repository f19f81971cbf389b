"""How much delay of the specimen's force the uniaxial benchmark stands."""

from __future__ import annotations

from bisect import bisect_left
from dataclasses import replace

import numpy as np
from scipy.optimize import brentq
from uniaxial_loop import Loop, Rules, numerical


def receptance(case, s, rules=Rules()):
    """Specimen's dynamic stiffness x flexibility of the numerical substructure at storey 1, at s.

    s (n,) [rad/s] -> (n,).
    """
    c, (M, C, K) = rules.constants, numerical(case, rules)
    at = np.asarray(s)[:, None, None]
    flexibility = np.linalg.inv(M * at**2 + C * at + K)[:, 0, 0]
    return (c.m_e * s**2 + c.c_e * s + c.k_e) * flexibility


def critical_delays(case, rules=Rules()):
    """[(delay [s], frequency [Hz])] where 1 + H(s) exp(-s tau) has a root s = j omega.

    |H| = 1 fixes omega, the phase then fixes the smallest tau.  The smallest of all is the critical
    delay: without delay the loop is the reference structure, which is stable.
    """

    def at(f):
        return receptance(case, 2j * np.pi * np.atleast_1d(f), rules)

    def excess(f):
        return abs(at(f)[0]) - 1

    f = np.arange(0.05, 100, 0.01)
    above, found = abs(at(f)) > 1, []
    for i in np.flatnonzero(above[1:] != above[:-1]):
        root = brentq(excess, f[i], f[i + 1])
        found.append((np.angle(-at(root)[0]) % (2 * np.pi) / (2 * np.pi * root), root))
    return sorted(found)


def perfect_actuator(case, samples, rules=Rules()):
    """Matrix of a free step of the loop whose specimen's force is ``samples`` (>= 1) + 1/2 old.

    The specimen follows storey 1 exactly: f_e(k) = m_e a + c_e v + k_e x with the acceleration of
    the state and force of sample k.  A held force is half a sample older in the mean.
    """
    c, loop, n = rules.constants, Loop(case, rules), 6 + samples
    M_n, C_n, K_n = numerical(case, rules)
    A, force = loop.A[:6, :6], loop.B[:6, 1]
    row = np.zeros(n)  # of the force
    flexible = np.linalg.inv(M_n)[0]
    row[:6] = -c.m_e * np.r_[flexible @ K_n, flexible @ C_n]
    row[[0, 3]] += c.k_e, c.c_e
    row[-1] -= c.m_e * flexible[0]  # the force that acts at sample k
    step = np.eye(n, k=-1)
    step[:6] = 0.0
    step[:6, :6], step[:6, -1] = A, force
    step[6] = row
    return step


def radius(step):
    """Spectral radius of a matrix."""
    return abs(np.linalg.eigvals(step)).max()


def critical_samples(case, rules=Rules()):
    """The largest number of samples of delay that the stepped loop stands."""
    return first_true(lambda d: radius(perfect_actuator(case, d, rules)) > 1, range(1, 200)) - 1


def reserve(case, rules=Rules()):
    """Further samples of delay that the loop stands; None where it is unstable already."""

    def unstable(extra):
        delayed = replace(rules, force_delay=rules.force_delay + extra)
        return abs(Loop(case, delayed).poles()[0]) > 1

    return first_true(unstable, range(200)) - 1 if not unstable(0) else None


def first_true(condition, numbers):
    """The first of ``numbers`` for which a condition holds that then holds for all above."""
    return numbers[bisect_left(numbers, True, key=condition)]
