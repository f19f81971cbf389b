"""The uniaxial RTHS benchmark (Silva et al. 2020) as a plain loop in NumPy: one sample, one matrix.

A three-storey frame whose first-storey column of mass m_e, damping c_e and stiffness k_e stands in
the laboratory.  The rest is computed:

    (M - M_e) x'' + (C - C_e) x' + (K - K_e) x = -M 1 a_g - f_e e_1,

M_e = m_e e_1 e_1^T and so on, f_e the specimen's force m_e y'' + c_e y' + k_e y at the stroke y of
the actuator.  Valve, actuator and specimen,

    p'' + b1 p' + b2 p = a1b0 (g u - y),    f' = -a3 f + p - a2 y',    m_e y'' + c_e y' + k_e y = f,

turn the command u into the stroke.  ``Rules`` holds what the published text leaves open.  Nothing
of the package is used here: this is the measure that it is held against.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh, expm

FS = 4096  # Hz
DT = 1 / FS
K = 1e7 * np.array(
    [[2.6055, -2.3134, 0.5937], [-2.3134, 3.2561, -1.4420], [0.5937, -1.4420, 0.9267]]
)  # N/m
CASES = {1: (1000.0, 0.05), 2: (1100.0, 0.04), 3: (1300.0, 0.03), 4: (1000.0, 0.03)}  # kg, -
PI = ((2.0, 95.0), (1.0, 0.0))  # 2 + 95/s
LEAD = ((50.8, 50.8 * 168.6), (1.0, 8570.0))  # 50.8 (s + 168.6) / (s + 8570)
NOISE_X, NOISE_F = 6.25e-14, 1.16e-3  # two-sided power, m^2 s and N^2 s: variance = power * fs
METRE_PER_VOLT, NEWTON_PER_VOLT, STEP, RANGE = 7.89e-3, 1096.0, 2.0**-18, 3.8
OUTPUTS = ("x1", "x2", "x3", "measured", "command", "force", "stroke", "velocity")
STAGES = 11  # continuous states: x (3), x' (3), y, y', f, p, p'
Y, V, F, P, Q = range(6, STAGES)


@dataclass(frozen=True)
class Constants:
    """The transfer system's numbers and the specimen's (SI)."""

    a1b0: float = 2.1283e13
    a2: float = 4.2297e6
    a3: float = 3.3
    b1: float = 425.0
    b2: float = 9.9976e4
    gain: float = 1.0261
    m_e: float = 29.13
    k_e: float = 1.19e6
    c_e: float = 2 * 0.0097 * np.sqrt(29.13 * 1.19e6)


PACKAGE = Constants()
TEXT = Constants(2.13e13, 4.23e6, 3.3, 425.0, 1e5, 1.0, 29.1, 1.19e6, 114.6)


@dataclass(frozen=True)
class Rules:
    """What a simulation has to choose.  The defaults come closest to the published table.

    Attributes:
        constants: ``PACKAGE``, the numbers of the public code, or ``TEXT``.
        target_delay: samples between the structure's displacements and those that the controller
            and the indices see.
        force: ``held`` from sample to sample, or ``coupled``: felt by the structure at once.
        force_delay: samples between the measured force and the one that is held.
        force_parts: ``mcx`` the specimen's whole force, ``cx`` without its inertia, ``x`` k_e y.
        gain_at: where the gain of the transfer system sits, ``command`` or ``measurement``.
        moved: what of the specimen is taken from the numerical substructure besides k_e.
        ground: the record between samples, ``linear`` or ``held``.
        lead: the phase lead works on the ``target``, on the ``error``, or not at all (``none``).
        pi: the PI loop around the transfer system is closed.
        rule: of the controllers' discretisation, ``bilinear`` or ``backward``.
        converters: ``none``, ``rounded`` to 18 bits, ``clipped``: that and +-3.8 V.
    """

    constants: Constants = PACKAGE
    target_delay: int = 1
    force: str = "held"
    force_delay: int = 0
    force_parts: str = "mcx"
    gain_at: str = "command"
    moved: str = "mc"
    ground: str = "linear"
    lead: str = "target"
    pi: bool = True
    rule: str = "bilinear"
    converters: str = "none"


def modal_damping(M, K, ratio):
    """C = M Phi diag(2 zeta omega) Phi^T M, Phi of unit modal mass."""
    squares, modes = eigh(K, M)
    return M @ modes @ np.diag(2 * ratio * np.sqrt(squares)) @ modes.T @ M


def reference(case):
    """M, C, K of the whole structure of a case."""
    mass, ratio = CASES[case]
    M = mass * np.eye(3)
    return M, modal_damping(M, K, ratio), K


def numerical(case, rules=Rules()):
    """M_n, C_n, K_n: the reference structure less the specimen at storey 1."""
    (M, C, stiffness), c, e = reference(case), rules.constants, np.diag([1.0, 0, 0])
    return (
        M - c.m_e * ("m" in rules.moved) * e,
        C - c.c_e * ("c" in rules.moved) * e,
        stiffness - c.k_e * e,
    )


def first_order(M, C, K):
    """A of (x, x')."""
    return np.block([[np.zeros((3, 3)), np.eye(3)], [-np.linalg.solve(M, np.hstack([K, C]))]])


def held_input(A, B):
    """(A_d, B_d) over one sample for an input that stays."""
    n, m = B.shape
    E = expm(np.block([[A, B], [np.zeros((m, n + m))]]) * DT)
    return E[:n, :n], E[:n, n:]


def linear_input(A, b):
    """(A_d, b_now, b_next) over one sample for an input that runs straight to its next value."""
    n = len(b)
    E = np.zeros((n + 2, n + 2))
    E[:n, :n], E[:n, n], E[n, n + 1] = A * DT, b * DT, 1.0
    E = expm(E)
    return E[:n, :n], E[:n, n] - E[:n, n + 1], E[:n, n + 1]


def discrete(filter, rule):
    """(c0, c1, d1) of y(k) = c0 x(k) + c1 x(k-1) - d1 y(k-1) for (b1 s + b0) / (a1 s + a0)."""
    (b1, b0), (a1, a0) = filter
    h, w = (2 / DT, 1.0) if rule == "bilinear" else (1 / DT, 0.0)
    scale = a1 * h + a0
    return (b1 * h + b0) / scale, (b0 * w - b1 * h) / scale, (a0 * w - a1 * h) / scale


class Loop:
    """The closed loop of one case.

    ``sample`` is the order of events; ``matrix`` is the same written as one matrix, for speed and
    for eigenvalues.
    """

    def __init__(self, case, rules=Rules()):
        self.rules, c = rules, rules.constants
        M_n, C_n, K_n = numerical(case, rules)
        inverse = np.linalg.inv(M_n)
        A, ground, force, command = np.zeros((STAGES, STAGES)), *np.zeros((3, STAGES))
        A[:6, :6] = first_order(M_n, C_n, K_n)
        ground[3:6] = -inverse @ reference(case)[0] @ np.ones(3)
        force[3:6] = -inverse[:, 0]
        A[Y, V], A[V, [Y, V, F]] = 1.0, np.array([-c.k_e, -c.c_e, 1.0]) / c.m_e
        A[F, [V, F, P]] = -c.a2, -c.a3, 1.0
        A[P, Q], A[Q, [Y, P, Q]] = 1.0, (-c.a1b0, -c.b2, -c.b1)
        inside, outside = (c.gain, 1.0) if rules.gain_at == "command" else (1.0, c.gain)
        command[Q] = c.a1b0 * inside
        self.stroke, self.felt = outside * np.eye(STAGES)[Y], np.zeros(STAGES)
        if rules.force_parts == "mcx":
            self.felt[F] = 1.0
        else:
            self.felt[[Y, V]] = c.k_e, c.c_e * ("c" in rules.force_parts)
        self.coupled = rules.force == "coupled"
        if self.coupled:
            A += np.outer(force, self.felt)
        self.A, self.ground, self.ground_next = linear_input(A, ground)
        if rules.ground == "held":
            self.ground = self.ground + self.ground_next
            self.ground_next = np.zeros(STAGES)
        self.B = held_input(A, np.stack([command, force], 1))[1]
        self.lead = discrete(LEAD, rules.rule) if rules.lead != "none" else (1.0, 0.0, 0.0)
        self.pi = discrete(PI, rules.rule) if rules.pi else (1.0, 0.0, 0.0)
        self.size = STAGES + 4 + rules.force_delay + 3 * rules.target_delay

    def sample(self, state, inputs):
        """One sample: (state, (a_g(k), a_g(k+1), n_x, n_f)) -> (state at k+1, outputs at k)."""
        rules, (a_now, a_next, n_x, n_f) = self.rules, inputs
        z, (b1, r1, e1, u1) = state[:STAGES], state[STAGES : STAGES + 4]
        forces = state[STAGES + 4 : STAGES + 4 + rules.force_delay]
        targets = state[STAGES + 4 + rules.force_delay :].reshape(-1, 3)

        measured = self.convert(self.stroke @ z + n_x, METRE_PER_VOLT)
        force = 0.0 if self.coupled else self.felt @ z
        force = self.convert(force + n_f, NEWTON_PER_VOLT)
        targets, forces = np.vstack([z[:3], targets]), np.r_[force, forces]
        target = targets[-1]  # target_delay samples old

        error_led = rules.lead == "error"
        before = target[0] - measured if error_led else target[0]
        after = self.lead[0] * before + self.lead[1] * b1 - self.lead[2] * r1
        error = after if error_led or not rules.pi else after - measured
        u = self.pi[0] * error + self.pi[1] * e1 - self.pi[2] * u1

        sent = self.convert(u, METRE_PER_VOLT)
        z_next = self.A @ z + self.ground * a_now + self.ground_next * a_next
        z_next = z_next + self.B @ np.array([sent, forces[-1]])  # force_delay samples old
        state = np.r_[z_next, before, after, error, u, forces[:-1], targets[:-1].ravel()]
        return state, np.r_[target, measured, sent, self.felt @ z, z[Y], z[V]]

    def convert(self, value, per_volt):
        """A value through an 18-bit converter."""
        if self.rules.converters == "none":
            return value
        volts = value / per_volt
        if self.rules.converters == "clipped":
            volts = min(max(volts, -RANGE), RANGE)
        return np.round(volts / STEP) * STEP * per_volt

    def matrix(self):
        """[[L, D], [H, E]]: column j is the sample of a loop at rest but for number j, which is 1.

        Shape (size + 8, size + 4); needs a linear loop, so no converters.
        """
        unit = np.eye(self.size + 4)
        return np.stack([np.r_[self.sample(e[: self.size], e[self.size :])] for e in unit], 1)

    def poles(self):
        """Eigenvalues of L, largest first."""
        values = np.linalg.eigvals(self.matrix()[: self.size, : self.size])
        return values[np.argsort(-abs(values))]


def noise(samples, seed):
    """(samples, 2) of displacement and force noise; none for ``seed`` None."""
    if seed is None:
        return np.zeros((samples, 2))
    white = np.random.default_rng(seed).standard_normal((samples, 2))
    return white * np.sqrt(np.array([NOISE_X, NOISE_F]) * FS)


def simulate(case, ground, seeds=(None,), rules=Rules()):
    """Signals by name, each (samples, seeds), for a record ``ground`` [m/s^2] at FS."""
    loop, following = Loop(case, rules), np.r_[ground[1:], 0.0]
    kept = np.empty((len(ground), len(OUTPUTS), len(seeds)))
    inputs = np.stack([np.c_[ground, following, noise(len(ground), s)] for s in seeds], 2)
    if rules.converters != "none":
        for j in range(len(seeds)):
            state = np.zeros(loop.size)
            for k in range(len(ground)):
                state, kept[k, :, j] = loop.sample(state, inputs[k, :, j])
    else:
        matrix, state = loop.matrix(), np.zeros((loop.size, len(seeds)))
        for k in range(len(ground)):
            both = matrix @ np.vstack([state, inputs[k]])
            state, kept[k] = both[: loop.size], both[loop.size :]
    return {name: kept[:, i] for i, name in enumerate(OUTPUTS)}


def reference_response(case, ground):
    """(samples, 3) displacements [m] of the whole structure, the record linear in between."""
    M, C, stiffness = reference(case)
    A, now, following = linear_input(first_order(M, C, stiffness), np.r_[np.zeros(3), -np.ones(3)])
    z, kept = np.zeros(6), np.empty((len(ground), 3))
    for k, (a, b) in enumerate(zip(ground, np.r_[ground[1:], 0.0], strict=True)):
        kept[k] = z[:3]
        z = A @ z + now * a + following * b
    return kept
