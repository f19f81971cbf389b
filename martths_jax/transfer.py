"""The plant's transfer functions: partial fractions, frequency response, zero-order hold.

    H_ij(s) = k_ij prod(s - z) / prod(s - p),   i = output, j = input

Column j of H shares its poles, so it is one four-state system with two outputs; the frame's pole
pair stands in both columns.  All poles are simple and known, so the modal form and its zero-order
hold are written down exactly (partial fractions) instead of being computed from a matrix
exponential: cheap for 100 000 plants, and differentiable in every zero and pole.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np

from martths_jax.structure.modal import ModalSystem

HZ = 2 * np.pi  # rad/s per Hz
#: Nominal zeros and poles [Hz]; the frame pair's entry scales ``FRAME_POLE_HZ``.
NOMINAL_HZ = np.array([-120.0, -90.0, -2.65, -40.0, 1.0, -3.0, -5.0, -3.5, -18.5])
FRAME_POLE_HZ = complex(-50.0, 63.0)
#: k_ij of the nominal plant, output by row.
NOMINAL_GAIN = np.array([[2165.2, 4.5394e6], [349.95, 1.9238e7]])


#: Real and complex poles are combined here, whatever the caller allows elsewhere.
_mixing = jax.numpy_dtype_promotion("standard")


@_mixing
def _factors(parameters_hz: jax.Array, xp=jnp):
    """Zeros, real poles, frame pole [rad/s] and rescaled gains of a batch of plants.

    Returns:
        zeros: per output and column, list of (T,) arrays; poles: per column (p1, p2); frame: (T,)
        complex; gain: (2, 2, T), rescaled so that the DC gain stays nominal.
    """
    s = xp.moveaxis(xp.asarray(parameters_hz), -1, 0) * HZ
    z1, z2, p1, p2, frame, z12, z22, p3, p4 = s
    frame = frame * FRAME_POLE_HZ
    zeros = [[(z1, z2), (z12,)], [(z1, z2), (z22,)]]
    poles = [(p1, p2), (p3, p4)]
    n = NOMINAL_HZ * HZ
    nominal_zeros = [[(n[0], n[1]), (n[5],)], [(n[0], n[1]), (n[6],)]]
    nominal_poles = [(n[2], n[3]), (n[7], n[8])]
    pair = abs(FRAME_POLE_HZ * HZ) ** 2
    gain = []
    for i in range(2):
        row = []
        for j in range(2):
            dc = NOMINAL_GAIN[i, j] * np.prod([-z for z in nominal_zeros[i][j]])
            dc = dc / (np.prod([-p for p in nominal_poles[j]]) * pair)
            numerator = xp.prod(xp.stack([-z for z in zeros[i][j]]), axis=0)
            row.append(dc * poles[j][0] * poles[j][1] * (frame * frame.conj()).real / numerator)
        gain.append(row)
    return zeros, poles, frame, gain


@_mixing
def frequency_response(parameters_hz, frequency_hz) -> jax.Array:
    """H(j 2 pi f) of a batch of plants.

    Args:
        parameters_hz: (T, 9) as in ``Plants.parameters_hz``.
        frequency_hz: (F,) frequencies [Hz].

    Returns:
        (F, 2, 2, T) complex response, mm a mm; by NumPy, without compiling, for NumPy's arrays.
    """
    xp = np if isinstance(parameters_hz, np.ndarray) else jnp
    zeros, poles, frame, gain = _factors(parameters_hz, xp)
    s = 2j * xp.pi * xp.asarray(frequency_hz)[:, None]

    def entry(i, j):
        numerator = gain[i][j][None] * xp.ones_like(s)
        for z in zeros[i][j]:
            numerator = numerator * (s - z[None])
        p, q, pair = poles[j][0][None], poles[j][1][None], frame[None]
        return numerator / ((s - p) * (s - q) * (s - pair) * (s - pair.conj()))

    return xp.stack([xp.stack([entry(i, j) for j in range(2)], 1) for i in range(2)], 1)


@_mixing
def continuous_modes(parameters_hz: jax.Array):
    """Partial fractions of a batch of plants.

    Returns:
        poles: (4, T) complex: real pair of column 1, its frame pole, then the same of column 2
            as (p1, p2, frame) -> arrays ``real`` (2 columns, 2, T) and ``frame`` (T,).
        residues: ``real`` (2 outputs, 2 columns, 2, T) and ``frame`` (2 outputs, 2 columns, T).
    """
    zeros, poles, frame, gain = _factors(parameters_hz)
    real_residue, frame_residue = [], []
    for i in range(2):
        row_real, row_frame = [], []
        for j in range(2):
            p, q = poles[j]

            def numerator(s, i=i, j=j):
                value = gain[i][j]
                for z in zeros[i][j]:
                    value = value * (s - z)
                return value

            pair_p = ((p - frame) * (p - frame.conj())).real
            pair_q = ((q - frame) * (q - frame.conj())).real
            row_real.append(
                jnp.stack([numerator(p) / ((p - q) * pair_p), numerator(q) / ((q - p) * pair_q)])
            )
            row_frame.append(
                numerator(frame) / ((frame - p) * (frame - q) * (frame - frame.conj()))
            )
        real_residue.append(jnp.stack(row_real))
        frame_residue.append(jnp.stack(row_frame))
    real = jnp.stack([jnp.stack(pair) for pair in poles])
    return real, frame, jnp.stack(real_residue), jnp.stack(frame_residue)


def discretise_parameters(parameters_hz: jax.Array, dt: float) -> ModalSystem:
    """Zero-order hold of a batch of plants, in modal form.

    Slots: real pair and frame pair of column 1, then of column 2.  The states are those of the
    continuous modal form z' = p z + u, sampled, so a gain designed in continuous time holds.

    Args:
        parameters_hz: (T, 9) zeros and poles [Hz].
        dt: sample period [s].
    """
    real, frame, real_residue, frame_residue = continuous_modes(parameters_hz)
    T = frame.shape[0]
    decay, turn = jnp.exp(real * dt), jnp.exp(frame * dt)
    push, push_frame = (decay - 1) / real, (turn - 1) / frame
    a = jnp.stack([decay[0], jnp.stack([turn.real] * 2), decay[1], jnp.stack([turn.real] * 2)], 1)
    swap = jnp.stack([-turn.imag, turn.imag])
    b = jnp.stack([jnp.zeros((2, T)), swap, jnp.zeros((2, T)), swap], 1)
    frame_input = jnp.stack([push_frame.real, push_frame.imag])
    column = [jnp.stack([push[j], frame_input], 1) for j in range(2)]  # (2, 2 slots, T)
    none = jnp.zeros((2, 2, T))
    B = jnp.stack([jnp.concatenate([column[0], none], 1), jnp.concatenate([none, column[1]], 1)], 2)
    rows = []
    for i in range(2):
        slots = []
        for j in range(2):
            slots.append(real_residue[i, j])
            slots.append(jnp.stack([2 * frame_residue[i, j].real, -2 * frame_residue[i, j].imag]))
        rows.append(jnp.stack(slots, 1))
    return ModalSystem(a=a, b=b, B=B, C=jnp.stack(rows))
