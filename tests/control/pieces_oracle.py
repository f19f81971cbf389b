"""An adaptive feedforward beside a small made-up plant: by the engine, and in plain NumPy.

The plant answers a command one sample later, x(k) = H u(k-1) + noise; the targets are noise too.
"""

from __future__ import annotations

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np

from martths_jax.control.compensator import Compensator
from martths_jax.control.controllers.feedforward import follow_target
from martths_jax.control.estimators import DirectMeasurement

N, TRIALS, DT = 70, 2, 1 / 1024
PLANT = np.array([[0.9, 0.1], [-0.2, 0.7]])
_rng = np.random.default_rng(5)
TARGET, NOISE = _rng.standard_normal((N, 2, TRIALS)), 0.4 * _rng.standard_normal((N, 2, TRIALS))


def engine(controller, benchmark, target=TARGET, noise=NOISE):
    """Coefficients (N, n, 2, T), commands (N, 2, T) and fits held (N, T) of the box itself."""
    controller = replace(controller, estimator=DirectMeasurement())
    assert not controller.problems(benchmark)
    box = Compensator.of(controller, benchmark)

    def sample(carry, given):
        state, command = carry
        measured = jnp.asarray(PLANT) @ command + given[1]
        state, command, signals = box.step(state, given[0], measured)
        return (state, command), (signals["C_A"], command, signals["held"])

    start = box.init(TRIALS), jnp.zeros((2, TRIALS))
    run = jax.jit(lambda given: jax.lax.scan(sample, start, given)[1])
    return [np.asarray(x) for x in run((jnp.asarray(target), jnp.asarray(noise)))]


def textbook(matrix, joint, learn, *, start=None, law=lambda u: u, both=lambda x: x,
             target=TARGET, noise=NOISE, of_targets=None):  # fmt: skip
    """The same by textbook: every sample looks at the whole past again.

    Args:
        matrix: (n, taps) of the regressor; of_targets: of that of the targets, if it is another.
        joint: one problem, or one an actuator.
        learn: (k, Phi (k+1, n), U (k+1, sides), last (n, sides), part) -> coefficients, fits held.
        start: (n, 2) coefficients; None follows the target.
        law: what becomes of a command.
        both: filter of strokes and commands along time, an array (k+1, 2).
    """
    C_all, u_all, held_all = [], [], []
    start = follow_target(len(matrix), joint) if start is None else start
    for trial in range(target.shape[2]):
        last, held = start.copy(), 0
        x, u = np.zeros((0, 2)), np.zeros((1, 2))  # the first command is that of k = -1
        for k in range(len(target)):
            x = np.vstack([x, PLANT @ u[-1] + noise[k, :, trial]])
            phi, applied = regressors(matrix, both(x)), both(u)
            own = matrix if of_targets is None else of_targets
            of_target = regressors(own, target[: k + 1, :, trial])[-1]
            new = np.zeros_like(last)
            for part, sides in enumerate([[0, 1]] if joint else [[0], [1]]):
                own = phi.reshape(k + 1, -1) if joint else phi[:, part]
                new[:, sides], more = learn(k, own, applied[:, sides], last[:, sides], part)
                held += more
            last = new
            command = [
                last[:, i] @ (of_target.ravel() if joint else of_target[i]) for i in range(2)
            ]
            u = np.vstack([u, law(np.array(command))])
            C_all.append(last)
            u_all.append(u[-1])
            held_all.append(held)
    by_sample = lambda x: np.moveaxis(np.array(x).reshape(-1, len(target), *np.shape(x)[1:]), 0, -1)  # noqa: E731
    return [by_sample(x) for x in (C_all, u_all, held_all)]


def regressors(matrix, x):
    """(N, 2, n) of strokes (N, 2) that were zero before."""
    taps = matrix.shape[1]
    padded = np.vstack([np.zeros((taps - 1, 2)), x])
    late = np.stack([padded[taps - 1 - i : len(padded) - i] for i in range(taps)], axis=-1)
    return late @ matrix.T


def window(nb, hop=1, *, reach, change=None, good=None, cut=None):
    """``learn`` of a window: G and h changed, the result trusted or not, and cut."""

    def learn(k, phi, u, last, part):
        if k < nb + reach or (k - nb - reach) % hop:
            return last, 0
        rows, values = phi[-nb:], u[-nb:]
        G, h = rows.T @ rows, rows.T @ values
        if change:
            G, h = change(G, h, last, part)
        C = np.linalg.solve(G, h)
        if good and not good(C, G, phi, part):
            return last, 1
        return (cut(C, last, part) if cut else C), 0

    return learn
