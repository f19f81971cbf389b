"""From a second-order structure to the discrete system that the time loop steps."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from martths_jax.structure.frame import (
    FORCE_DOFS,
    N_FREE,
    OUTPUT_DOFS,
    Structure,
    independent_coordinate,
)
from martths_jax.structure.integrators import Integrator
from martths_jax.structure.modal import ModalSystem, balanced_truncation, from_dense


@dataclass(frozen=True)
class Ports:
    """Where a structure is pushed, and what of it is looked at.

    Attributes:
        forces: (n, f) coordinates that each force acts on.
        outputs: (o, n) displacements that are looked at.
        input_scale: (1 + f,) sizes that the inputs (a_g [m/s^2], forces [N, N m]) have in a run;
            only their ratios matter, to weigh them in the reduction.
        output_scale: (o,) likewise of the outputs [m, rad].
    """

    forces: np.ndarray
    outputs: np.ndarray
    input_scale: np.ndarray
    output_scale: np.ndarray


#: Sizes of the benchmark's inputs and outputs, see ``Ports``.
INPUT_SCALE = np.array([1.0, 1e4, 1e3, 1e3])
OUTPUT_SCALE = np.array([5e-3, 1e-2, 1e-2, 1e-2, 1e-2, 1e-2])


@cache
def frame_ports() -> Ports:
    """Those of the benchmark's frame: ``FORCE_DOFS`` and ``OUTPUT_DOFS``."""
    unit = np.eye(N_FREE)
    pushed, seen = ([independent_coordinate(d) for d in dofs] for dofs in (FORCE_DOFS, OUTPUT_DOFS))
    return Ports(unit[:, pushed], unit[seen], INPUT_SCALE, OUTPUT_SCALE)


def first_order(
    structure: Structure, ports: Ports | None = None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Continuous (A, B, C) with states (n displacements, velocities of the m with mass).

    Inputs are (a_g, forces), outputs displacements.  Coordinates without mass have stiffness and
    damping only, so their velocity follows from C_ss v_s = f_s - K_s d - C_sm v_m and the pencil
    stays regular.

    Args:
        structure: second-order model; coordinates without mass have damping of their own.
        ports: by default the benchmark's.
    """
    ports = ports or frame_ports()
    M, C, K = structure.M, structure.C, structure.K
    n = M.shape[0]
    heavy = np.any(M != 0, axis=1)
    m, s = np.flatnonzero(heavy), np.flatnonzero(~heavy)
    F = np.column_stack([-M @ structure.influence, ports.forces])
    S = np.linalg.inv(C[np.ix_(s, s)])
    # v = V_d d + V_m v_m + V_u u
    V_d, V_m, V_u = np.zeros((n, n)), np.zeros((n, m.size)), np.zeros((n, F.shape[1]))
    V_m[m] = np.eye(m.size)
    V_d[s], V_m[s], V_u[s] = -S @ K[s], -S @ C[np.ix_(s, m)], S @ F[s]
    M_inv = _inverse(M[np.ix_(m, m)])
    C_m = C[m]
    A = np.block(
        [
            [V_d, V_m],
            [-M_inv @ (K[m] + C_m @ V_d), -M_inv @ C_m @ V_m],
        ]
    )
    B = np.vstack([V_u, M_inv @ (F[m] - C_m @ V_u)])
    return A, B, np.hstack([ports.outputs, np.zeros((len(ports.outputs), m.size))])


def _inverse(M: np.ndarray) -> np.ndarray:
    """Inverse of a mass matrix, exact to the bit where it is diagonal."""
    diagonal = np.diag(np.diag(M))
    return np.diag(1 / np.diag(M)) if np.array_equal(M, diagonal) else np.linalg.inv(M)


def discretise(
    structure: Structure,
    integrator: Integrator,
    dt: float,
    *,
    ports: Ports | None = None,
    delay: int = 0,
    tolerance: float = 5e-11,
) -> ModalSystem:
    """Discrete modal system of a structure, reduced to the smallest order that keeps its response.

    Args:
        structure: second-order model.
        integrator: the time integration method.
        dt: time step [s].
        ports: inputs and outputs; by default the benchmark's.
        delay: samples by which the outputs come late, 0 or 1.
        tolerance: bound on the Hankel error left out, relative; 1e-11 keeps histories to about
            1e-10 of their peak.

    Returns:
        System with inputs (a_g, forces) and the outputs of the ports.
    """
    ports = ports or frame_ports()
    sizes, scales = ports.input_scale, ports.output_scale[:, None]
    A, B, C, D = integrator.discretise(*first_order(structure, ports), dt)
    if delay:
        A, B, C, D = _late(A, B, C, D)
    A_r, B_r, C_r = balanced_truncation(A, B * sizes, C / scales, tolerance)
    return from_dense(A_r, B_r / sizes, C_r * scales, D)


def _late(A, B, C, D):
    """The same system, whose outputs of a sample are given one sample later."""
    n, o = len(A), len(C)
    D = np.zeros((o, B.shape[1])) if D is None else D
    A = np.block([[A, np.zeros((n, o))], [C, np.zeros((o, o))]])
    return A, np.vstack([B, D]), np.hstack([np.zeros((o, n)), np.eye(o)]), None
