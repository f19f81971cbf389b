"""The three storeys of the uniaxial benchmark, and what of them stands in the laboratory.

    M x'' + C x' + K x = -M 1 a_g,                                        the reference structure
    (M - M_e) x'' + (C - C_e) x' + (K - K_e) x = -M 1 a_g - f_e e_1,      its numerical part

(Silva et al. 2020) with M_e = m_e e_1 e_1' and so on, f_e the force of the specimen at storey 1.
"""

from __future__ import annotations

import numpy as np
from scipy import linalg

from martths_jax.problem.uniaxial.plant import Loop
from martths_jax.structure.damping import modal_damping
from martths_jax.structure.frame import Structure
from martths_jax.structure.statespace import Ports

#: Stiffness of the storeys, shared by all cases [N/m].
K = 1e7 * np.array(
    [[2.6055, -2.3134, 0.5937], [-2.3134, 3.2561, -1.4420], [0.5937, -1.4420, 0.9267]]
)
#: Storey mass [kg] and modal damping ratio [-] of each case.
CASES = {1: (1000.0, 0.05), 2: (1100.0, 0.04), 3: (1300.0, 0.03), 4: (1000.0, 0.03)}
#: Forces enter at storey 1; the displacements of all storeys are looked at.
PORTS = Ports(
    forces=np.eye(3)[:, :1],
    outputs=np.eye(3),
    input_scale=np.array([1.0, 5e3]),
    output_scale=np.full(3, 5e-3),
)


def reference(case: int) -> Structure:
    """The whole structure of a case, with modal damping."""
    mass, ratio = CASES[case]
    M = mass * np.eye(3)
    squares, shapes = linalg.eigh(K, M)
    return Structure(M, modal_damping(M, np.sqrt(squares), shapes, ratio), K, np.ones(3))


def numerical(case: int, loop: Loop) -> Structure:
    """The structure of a case without the specimen; the ground still moves the whole mass."""
    whole, at = reference(case), np.diag([1.0, 0.0, 0.0])
    M = whole.M - loop.mass * at
    return Structure(
        M=M,
        C=whole.C - loop.damping * at,
        K=whole.K - loop.stiffness * at,
        influence=np.linalg.solve(M, whole.M @ whole.influence),
    )
