"""From a second-order structure to the discrete system that the time loop steps."""

from __future__ import annotations

import numpy as np

from martths_jax.structure.frame import FORCE_DOFS, OUTPUT_DOFS, Structure, independent_coordinate
from martths_jax.structure.integrators import Integrator
from martths_jax.structure.modal import ModalSystem, balanced_truncation, from_dense

#: Sizes that inputs (a_g [m/s^2], force [N], moments [N m]) and outputs (x [m], rotation [rad])
#: have in a run; only their ratios matter, to weigh them in the reduction.
INPUT_SCALE = np.array([1.0, 1e4, 1e3, 1e3])
OUTPUT_SCALE = np.array([5e-3, 1e-2, 1e-2, 1e-2, 1e-2, 1e-2])


def first_order(structure: Structure) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Continuous (A, B, C) with states (29 displacements, velocities of the 15 masses).

    Inputs are (a_g, force on floor-1 x, moment on node 4, moment on node 7), outputs the
    displacements of ``OUTPUT_DOFS``.  The rotations carry no mass, only stiffness and damping, so
    their velocity follows from C_ss v_s = f_s - K_s d - C_sm v_m and the pencil stays regular.
    """
    M, C, K = structure.M, structure.C, structure.K
    n = M.shape[0]
    m, s = np.flatnonzero(np.diag(M) > 0), np.flatnonzero(np.diag(M) == 0)
    F = np.zeros((n, 1 + len(FORCE_DOFS)))
    F[:, 0] = -M @ structure.influence
    for column, dof in enumerate(FORCE_DOFS, 1):
        F[independent_coordinate(dof), column] = 1.0
    S = np.linalg.inv(C[np.ix_(s, s)])
    # v = V_d d + V_m v_m + V_u u
    V_d, V_m, V_u = np.zeros((n, n)), np.zeros((n, m.size)), np.zeros((n, F.shape[1]))
    V_m[m] = np.eye(m.size)
    V_d[s], V_m[s], V_u[s] = -S @ K[s], -S @ C[np.ix_(s, m)], S @ F[s]
    M_inv = np.diag(1 / np.diag(M)[m])
    C_m = C[m]
    A = np.block(
        [
            [V_d, V_m],
            [-M_inv @ (K[m] + C_m @ V_d), -M_inv @ C_m @ V_m],
        ]
    )
    B = np.vstack([V_u, M_inv @ (F[m] - C_m @ V_u)])
    outputs = np.zeros((len(OUTPUT_DOFS), A.shape[0]))
    for row, dof in enumerate(OUTPUT_DOFS):
        outputs[row, independent_coordinate(dof)] = 1.0
    return A, B, outputs


def discretise(
    structure: Structure, integrator: Integrator, dt: float, *, tolerance: float = 5e-11
) -> ModalSystem:
    """Discrete modal system of a structure, reduced to the smallest order that keeps its response.

    Args:
        structure: second-order model.
        integrator: the time integration method.
        dt: time step [s].
        tolerance: bound on the Hankel error left out, relative; 1e-11 keeps histories to about
            1e-10 of their peak.

    Returns:
        System with inputs (a_g, f_1, f_2, f_3) and outputs in the order of ``OUTPUT_DOFS``.
    """
    A, B, C, D = integrator.discretise(*first_order(structure), dt)
    B_s, C_s = B * INPUT_SCALE, C / OUTPUT_SCALE[:, None]
    A_r, B_r, C_r = balanced_truncation(A, B_s, C_s, tolerance)
    return from_dense(A_r, B_r / INPUT_SCALE, C_r * OUTPUT_SCALE[:, None], D)
