"""The control plant: two actuators with their controllers, pushing one frame (mm in, mm out).

Nine of its zeros and poles are uncertain; ``transfer`` has what follows from them.
"""

from __future__ import annotations

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np

from martths_jax.errors import InputError, argument_error, check_seed, check_whole
from martths_jax.runtime import check_precision, check_runtime
from martths_jax.structure.modal import ModalSystem
from martths_jax.transfer import (
    FRAME_POLE_HZ,
    NOMINAL_HZ,
    discretise_parameters,
    frequency_response,
)

#: The nine uncertain parameters in the order of the draws.
PARAMETERS = (
    "zero1_col1", "zero2_col1", "pole1_col1", "pole2_col1", "frame_pair",
    "zero_h12", "zero_h22", "pole1_col2", "pole2_col2",
)  # fmt: skip
#: Relative standard deviation of each parameter (paper, Table 2).
SIGMA = np.array([0.055, 0.055, 0.06, 0.06, 0.05, 0.03, 0.03, 0.03, 0.03])
#: Largest trial number: random streams tell 32 bits of them apart.
MOST_TRIALS = 2**32 - 1
PLANT_STREAM = 0  # separates plant draws from noise draws of the same seed


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Plants:
    """A batch of T plants, given by how far each parameter is from nominal.

    Attributes:
        draws: (T, 9) standard normal draws in the order of ``PARAMETERS``.
        trial: (T,) numbers of the trials, which also select their sensor noise.
        spread: scale on every standard deviation of Table 2 [-].
        nominal_hz: (T, 9) zeros and poles [Hz] that the draws are counted from, as in
            ``parameters_hz``; None for the benchmark's, ``NOMINAL_HZ``.
    """

    draws: jax.Array
    trial: jax.Array
    spread: jax.Array | float = 1.0
    nominal_hz: jax.Array | None = None

    def __len__(self) -> int:
        return self.draws.shape[0]

    def __getitem__(self, which) -> Plants:
        """The chosen trials, which keep their numbers; an integer gives a batch of one."""
        if isinstance(which, (int, np.integer)):
            which = [which]
        index = np.arange(len(self))[which]
        nominal = None if self.nominal_hz is None else self.nominal_hz[index]
        return Plants(self.draws[index], self.trial[index], self.spread, nominal)

    @property
    def parameters_hz(self) -> jax.Array:
        """(T, 9) zeros and poles [Hz]; the frame pair's entry is the factor on the pair."""
        nominal = NOMINAL_HZ[None] if self.nominal_hz is None else self.nominal_hz
        return nominal * (1 + SIGMA[None] * self.spread * self.draws)

    @property
    def values(self) -> jax.Array:
        """(T, 9) values of the uncertain parameters: ``parameters_hz``."""
        return self.parameters_hz

    def frequency_response(self, frequency_hz) -> jax.Array:
        """(F, 2, 2, T) complex response, see ``transfer.frequency_response``."""
        return frequency_response(self.parameters_hz, frequency_hz)

    def discretise(self, dt: float) -> ModalSystem:
        """Zero-order-hold discretisation of every plant at `dt` [s]."""
        check_precision()
        return discretise_parameters(self.parameters_hz, dt)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class IdealPlants:
    """Actuators that reach every command one sample later, exactly: x_m(k+1) = u(k)."""

    trial: jax.Array

    def __len__(self) -> int:
        return self.trial.shape[0]

    def __getitem__(self, which) -> IdealPlants:
        if isinstance(which, (int, np.integer)):
            which = [which]
        return IdealPlants(self.trial[np.arange(len(self))[which]])

    def discretise(self, dt: float) -> ModalSystem:
        """One state per actuator that holds the last command."""
        T = len(self)
        zeros = jnp.zeros((2, 1, T))
        unit = jnp.broadcast_to(jnp.eye(2)[:, None, :, None], (2, 1, 2, T))
        return ModalSystem(
            a=zeros, b=zeros, B=unit, C=jnp.broadcast_to(jnp.eye(2)[:, :, None, None], (2, 2, 1, T))
        )


def draw_plants(
    n: int,
    seed: int = 0,
    *,
    first: int = 1,
    spread: float = 1.0,
    around: Plants | None = None,
) -> Plants:
    """Draw uncertain plants (paper, Table 2); trial i depends on (seed, i) alone.

    Args:
        n: how many.
        seed: seed of the study, from 0 to 2^63 - 1.
        first: number of the first trial; trial 0 is the nominal plant by convention, so draws
            start at 1.
        spread: factor on the standard deviations [-].
        around: one plant that they scatter about, by the relative deviations of Table 2; the
            benchmark's nominal plant by default.

    Returns:
        Trials first ... first + n - 1.

    Raises:
        InputError: for a number that cannot be used, or an unstable plant.
    """
    check_runtime()
    check_whole("n", n, 1, MOST_TRIALS)
    check_whole("first", first, 0, MOST_TRIALS - n)
    check_seed(seed)
    spread = _checked_spread(spread)
    trial = jnp.arange(first, first + n)
    stream = jax.random.fold_in(jax.random.key(seed), PLANT_STREAM)
    draw = jax.vmap(lambda i: jax.random.normal(jax.random.fold_in(stream, i), (9,)))
    nominal = None
    if around is not None:
        nominal = jnp.broadcast_to(one_plant("around", around).parameters_hz, (n, 9))
    return check_plants(Plants(draw(trial), trial, spread, nominal))


def plant_from_draws(draws, *, trial=None, spread: float = 1.0) -> Plants:
    """Plants from given standard normal draws; ``zeros(9)`` is the nominal plant.

    Args:
        draws: (9,) or (T, 9), in the order zero 1, zero 2, pole 1, pole 2 of column 1, frame pair,
            zero of H12, zero of H22, pole 1, pole 2 of column 2.
        trial: (T,) trial numbers; 0, 1, ... by default.
        spread: factor on the standard deviations of Table 2 [-].

    Raises:
        InputError: for a wrong shape, a value that is not finite, or an unstable plant.
    """
    draws = _rows("draws", draws)
    trial = jnp.arange(draws.shape[0]) if trial is None else jnp.asarray(trial)
    return check_plants(Plants(draws, trial, _checked_spread(spread)))


def plant_from_hz(parameters_hz, *, trial=None) -> Plants:
    """A plant of one's own from its zeros and poles; its gains keep the benchmark's static ones.

    ``build_benchmark(plant=...)`` lets every controller and filter know it, and
    ``draw_plants(n, around=...)`` draws uncertain ones about it.

    Args:
        parameters_hz: (9,) or (T, 9) zeros and poles [Hz] in the order of ``PARAMETERS``, negative
            as the benchmark's (``NOMINAL_HZ``); the fifth is the factor on the frame's pole pair.
        trial: (T,) trial numbers; 0, 1, ... by default.

    Raises:
        InputError: for a wrong shape, a value that is not finite, an unstable plant, or one with
            two equal poles in a column, which has no modal form.
    """
    values = _rows("parameters_hz", parameters_hz)
    for one, other in ((2, 3), (7, 8)):
        alike = np.isclose(values[:, one], values[:, other], rtol=1e-6, atol=0)
        if np.any(alike):
            raise argument_error(
                "parameters_hz", f"have another {PARAMETERS[one]} than {PARAMETERS[other]}",
                f"{values[np.argmax(alike), one]:g} for both in row {np.argmax(alike)}",
            )  # fmt: skip
    trial = jnp.arange(values.shape[0]) if trial is None else jnp.asarray(trial)
    return check_plants(Plants(jnp.zeros_like(values), trial, 1.0, values), "parameters_hz")


def _rows(name: str, given) -> jax.Array:
    """(T, 9) numbers from what a user gave, one plant or several."""
    check_runtime()
    try:
        rows = jnp.asarray(given, dtype=float)
    except (TypeError, ValueError):
        raise argument_error(name, "be numbers", repr(given)[:80]) from None
    if rows.shape[-1:] != (9,) or rows.ndim not in (1, 2) or rows.size == 0:
        raise argument_error(
            name,
            "have shape (9,) or (trials, 9)",
            f"shape {rows.shape}",
            f"The nine columns are {', '.join(PARAMETERS)}.",
        )
    return rows.reshape(-1, 9)


def _checked_spread(spread):
    if isinstance(spread, jax.core.Tracer):
        return spread
    try:
        value = float(spread)
    except (TypeError, ValueError):
        value = float("nan")
    if not 0 <= value < float("inf"):
        raise argument_error("spread", "be zero or positive and finite", repr(spread))
    return value


def nominal_plant() -> Plants:
    """The nominal plant, trial 0."""
    return plant_from_draws(np.zeros(9))


def one_plant(name: str, plant) -> Plants:
    """The argument `name` itself, if it is a batch of one plant with known zeros and poles.

    Raises:
        InputError: if it is not.
    """
    if not isinstance(plant, Plants) or len(plant) != 1:
        got = f"{len(plant)} plants" if isinstance(plant, Plants) else type(plant).__name__
        raise argument_error(name, "be one plant", got, "Use plant_from_hz(nine zeros and poles).")
    if any(isinstance(x, jax.core.Tracer) for x in jax.tree.leaves(plant)):
        raise argument_error(
            name, "be known when the benchmark is built", "a traced one", "Build it outside of jit."
        )
    return check_plants(plant)


def lowest_rate(parameters_hz) -> float:
    """Lowest sampling rate of a plant [Hz]: twice its fastest pole, whatever that pole's damping.

    Args:
        parameters_hz: (9,) zeros and poles as in ``Plants.parameters_hz``.
    """
    values = np.abs(np.asarray(parameters_hz))
    return 2 * max(*values[[2, 3, 7, 8]], abs(FRAME_POLE_HZ) * values[4])


def check_plants(plants: Plants, name: str = "draws") -> Plants:
    """Refuse draws that are not finite and plants with a pole that is not in the left half-plane.

    Args:
        plants: the batch.
        name: of the argument that gave it.

    Raises:
        InputError: naming the first such trial and parameter.
    """
    if any(isinstance(x, jax.core.Tracer) for x in jax.tree.leaves(plants)):
        return plants
    given = plants.draws if plants.nominal_hz is None else plants.nominal_hz + plants.draws
    given, values = np.asarray(given), np.asarray(plants.parameters_hz)
    bad = np.argwhere(~np.isfinite(given))
    if bad.size:
        row, column = bad[0]
        raise argument_error(
            name, "be finite", f"{given[row, column]} for {PARAMETERS[column]} in row {row}"
        )
    poles = [2, 3, 4, 7, 8]
    unstable = np.argwhere(values[:, poles] * np.sign(NOMINAL_HZ[poles]) <= 0)
    if unstable.size:
        row, column = unstable[0][0], poles[unstable[0][1]]
        remedy = f"keep the draw above {-1 / (SIGMA[column] * float(plants.spread)):.1f}."
        if name != "draws":
            remedy = "poles are negative, the frame pair's factor is positive."
        raise InputError(
            f"Argument `{name}` must give stable plants, but row {row} moves {PARAMETERS[column]} "
            f"to {values[row, column]:.3g} (nominal {NOMINAL_HZ[column]:g}); {remedy}"
        )
    still = np.argwhere(values == 0)
    if still.size:
        row, column = still[0]
        raise argument_error(
            name, "give zeros other than 0 Hz, which would take away the static gain",
            f"{PARAMETERS[column]} = 0 in row {row}",
        )  # fmt: skip
    return plants
