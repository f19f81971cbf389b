"""Plants that are described by a state space, all of whose inputs drive the same states."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from martths_jax.errors import InputError, argument_error
from martths_jax.rig.dynamics import Dynamics
from martths_jax.rig.entries import of_coefficients
from martths_jax.rig.modal import Matrix, Mode, joint_modes, residues
from martths_jax.rig.numbers import Batch, Number, names_in, real_numbers

#: Roots of an uncertain state space's characteristic polynomial may differ from its eigenvalues by
#: this share; those of large matrices lose digits.
AGREE = 1e-8


@dataclass(frozen=True)
class StateSpace(Dynamics):
    """x' = A x + B u, y = C x, in SI units of time; D is zero, since no plant answers at once.

    Its poles are the roots of det(s I - A), and C adj(s I - A) B the numerators (Faddeev and
    LeVerrier): M_1 = I, c_k = -trace(A M_k) / k, M_(k+1) = A M_k + c_k I.

    Attributes:
        A, B, C: rows of numbers, (n, n), (n, inputs), (outputs, n); each real, a name, or
            ``Scaled``.

    Raises:
        InputError: for shapes that do not fit, or what is no real number or name.
    """

    A: tuple[tuple[Number, ...], ...]
    B: tuple[tuple[Number, ...], ...]
    C: tuple[tuple[Number, ...], ...]

    def __post_init__(self):
        for name in "ABC":
            rows = getattr(self, name)
            if isinstance(rows, str) or not hasattr(rows, "__iter__"):
                raise argument_error(name, "be rows of numbers", repr(rows)[:80])
            object.__setattr__(self, name, tuple(real_numbers(name, row) for row in rows))
        n, inputs = len(self.A), len(self.B[0]) if self.B else 0
        for name, rows, columns in (("A", n, n), ("B", n, inputs), ("C", len(self.C), n)):
            got = getattr(self, name)
            if not rows or not columns or len(got) != rows or {len(r) for r in got} != {columns}:
                lengths = [len(row) for row in got]
                raise argument_error(
                    name, f"have {rows or 'one or more'} rows of {columns or 'one or more'} "
                    "numbers", f"rows of {lengths}",
                )  # fmt: skip

    @property
    def shape(self) -> tuple[int, int]:
        return len(self.C), len(self.B[0])

    @property
    def names(self) -> set[str]:
        return names_in(x for M in (self.A, self.B, self.C) for row in M for x in row)

    def matrix(self, batch: Batch) -> Matrix:
        xp = batch.xp

        def array(rows):
            columns = [xp.stack([batch.number(x) for x in row], axis=-1) for row in rows]
            return xp.stack(columns, axis=-2)  # (T, rows, columns)

        A, B, C = (array(rows) for rows in (self.A, self.B, self.C))
        n = len(self.A)
        M = xp.broadcast_to(xp.eye(n), A.shape)
        denominator, numerators = [batch.full(1.0)], []
        for k in range(1, n + 1):
            numerators.append(C @ M @ B)
            product = A @ M
            c = -xp.trace(product, axis1=-2, axis2=-1) / k
            denominator.append(c)
            M = product + c[:, None, None] * xp.eye(n)[None]
        poles = batch.roots("poles", denominator)
        if batch.learns:
            self._check_poles(A[0], poles)
        outputs, inputs = self.shape
        return [
            [
                of_coefficients([N[:, i, j] for N in numerators], denominator, poles, "poles")
                for j in range(inputs)
            ]
            for i in range(outputs)
        ]

    @staticmethod
    def _check_poles(A: np.ndarray, poles) -> None:
        """Refuse a matrix whose characteristic polynomial does not hold its eigenvalues well."""
        exact, found = np.linalg.eigvals(A), poles.stacked()[:, 0]
        distance = np.min(np.abs(exact[:, None] - found[None]), axis=1)
        if np.any(~(distance <= AGREE * np.max(np.abs(exact)))):
            raise argument_error(
                "A", "have eigenvalues that its characteristic polynomial gives to eight digits",
                f"{len(A)} states with a difference of {np.max(distance):.2g} rad/s",
                "Give a plant of so many states, or with nearly equal poles, as transfer functions "
                "by their poles.",
            )  # fmt: skip

    def groups(self, matrix: Matrix, batch: Batch) -> list[list[Mode]]:
        """One group: all inputs drive the same states."""
        if batch.learns:
            batch.kept["strongest"] = self._strongest(matrix)
        return [joint_modes(matrix, batch.kept["strongest"])]

    @staticmethod
    def _strongest(matrix: Matrix) -> tuple[tuple[int, int], ...]:
        """For each pole, the entry (i, j) with the largest residue of the nominal plant."""
        R = np.array([[np.ravel(residues(entry)) for entry in row] for row in matrix])
        size = np.max(np.abs(R), axis=(0, 1))
        poles = matrix[0][0].poles
        for pole, largest in zip(poles.real + poles.upper, size, strict=True):
            if not largest > 1e-13 * np.max(size):
                raise InputError(
                    f"State space (A, B, C) must have no states that inputs do not move or outputs "
                    f"do not see, but its pole {pole[0]:.6g} rad/s is of this kind; take it out."
                )
        flat = np.argmax(np.abs(R).reshape(-1, R.shape[2]), axis=0)
        places = np.unravel_index(flat, R.shape[:2])
        return tuple((int(i), int(j)) for i, j in zip(*places, strict=True))
