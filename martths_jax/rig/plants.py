"""Uncertain plants of any rig: n commands in, any outputs out, from whatever describes them."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np

from martths_jax.errors import InputError, argument_error, as_numbers, check_seed, check_whole
from martths_jax.rig import modal
from martths_jax.rig.modal import HZ, first_problem
from martths_jax.rig.model import PlantModel, batch_of, nominal_of
from martths_jax.runtime import check_precision, check_runtime
from martths_jax.structure.modal import ModalSystem, to_dense

#: Largest trial number: random streams tell 32 bits of them apart.
MOST_TRIALS = 2**32 - 1
#: Separates plant draws from other draws of the same seed, as for the benchmark's own plants.
PLANT_STREAM = 0


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class TransferPlants:
    """A batch of T plants of one model.

    Attributes:
        draws: (T, p) independent standard normal draws, in the order of the model's parameters.
        trial: (T,) numbers of the trials, which also select their sensor noise.
        model: what all of them have in common.
        spread: factor on every standard deviation [-].
        about: (T, p) parameters that the draws are counted from; None for the nominal ones.
    """

    draws: jax.Array
    trial: jax.Array
    model: PlantModel = field(metadata={"static": True})
    spread: jax.Array | float = 1.0
    about: jax.Array | None = None

    def __len__(self) -> int:
        return self.draws.shape[0]

    def __getitem__(self, which) -> TransferPlants:
        """The chosen trials, which keep their numbers; an integer gives a batch of one."""
        if isinstance(which, (int, np.integer)):
            which = [which]
        index = np.arange(len(self))[which]
        about = None if self.about is None else self.about[index]
        return TransferPlants(self.draws[index], self.trial[index], self.model, self.spread, about)

    @property
    def values(self) -> jax.Array:
        """(T, p) physical parameters."""
        return self.model.uncertainty.values(self.draws, self.spread, self.about)

    def discretise(self, dt: float) -> ModalSystem:
        """Zero-order-hold discretisation of every plant at `dt` [s].

        Slots hold the poles input by input (a state space's all together): real ones two by two,
        then pairs.  The states are those of z' = p z + u, sampled.

        Raises:
            InputError: for a rate below ``PlantModel.lowest_rate``.
        """
        check_precision()
        if not isinstance(dt, jax.core.Tracer):
            least = self.model.lowest_rate
            if not 0 < dt * least <= 1:
                raise argument_error(
                    "dt", f"be above zero and at most {1 / least:.4g} s, for {np.ceil(least):g} Hz "
                    f"or more: twice the plant's fastest pole ({least / 2:.3g} Hz)", repr(dt),
                )  # fmt: skip
        return _discretise(self.model, self.values, dt)

    def continuous(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Dense (A, B, C) of the plant that the draws scatter about, states as in ``to_dense``.

        It is the model's nominal plant, or the first of `about`; on the host.
        """
        nominal = [self.model.uncertainty.nominal] if self.about is None else self.about[:1]
        values = np.asarray(nominal, dtype=float)
        batch = batch_of(self.model, values, nominal_of(self.model).kept, xp=np)
        matrix = self.model.dynamics.matrix(batch)
        groups = self.model.dynamics.groups(matrix, batch)
        return to_dense(modal.continuous(groups))[:3]

    def frequency_response(self, frequency_hz) -> jax.Array:
        """H(j 2 pi f) of every plant.

        Args:
            frequency_hz: (F,) frequencies [Hz].

        Returns:
            (F, outputs, inputs, T) complex.
        """
        check_precision()
        return _frequency_response(self.model, self.values, jnp.asarray(frequency_hz, dtype=float))


@partial(jax.jit, static_argnums=0)
@modal.mixing
def _discretise(model: PlantModel, values: jax.Array, dt) -> ModalSystem:
    batch = batch_of(model, values, nominal_of(model).kept)
    groups = model.dynamics.groups(model.dynamics.matrix(batch), batch)
    return modal.discretise(groups, dt, values.shape[0])


@partial(jax.jit, static_argnums=0)
@modal.mixing
def _frequency_response(model: PlantModel, values: jax.Array, frequency_hz) -> jax.Array:
    matrix = model.dynamics.matrix(batch_of(model, values, nominal_of(model).kept))
    trials = values.shape[0]

    def at(s):
        value = lambda e: jnp.zeros(trials) if e is None else modal.value_at(e, s)  # noqa: E731
        rows = [[jnp.broadcast_to(value(e) + 0j, (trials,)) for e in row] for row in matrix]
        return jnp.stack([jnp.stack(row) for row in rows])

    return jax.vmap(at)(1j * HZ * frequency_hz)


def nominal(model: PlantModel) -> TransferPlants:
    """The nominal plant, trial 0."""
    return from_draws(model, np.zeros(len(model.uncertainty)))


def draw(
    model: PlantModel,
    n: int,
    seed: int = 0,
    *,
    first: int = 1,
    spread: float = 1.0,
    around: TransferPlants | None = None,
) -> TransferPlants:
    """Draw uncertain plants; trial i depends on (seed, i) alone.

    Args:
        model: what all of them have in common.
        n: how many.
        seed: seed of the study, from 0 to 2^63 - 1.
        first: number of the first trial; trial 0 is the nominal plant by convention.
        spread: factor on the standard deviations [-].
        around: one plant of the model that they scatter about; the nominal one by default.

    Returns:
        Trials first ... first + n - 1.

    Raises:
        InputError: for a number that cannot be used, or a plant without a stable modal form.
    """
    check_runtime()
    check_whole("n", n, 1, MOST_TRIALS)
    check_whole("first", first, 0, MOST_TRIALS - n)
    check_seed(seed)
    trial = jnp.arange(first, first + n)
    stream = jax.random.fold_in(jax.random.key(seed), PLANT_STREAM)
    numbers = (len(model.uncertainty),)
    one = jax.vmap(lambda i: jax.random.normal(jax.random.fold_in(stream, i), numbers))
    about = None
    if around is not None:
        if not isinstance(around, TransferPlants) or around.model != model or len(around) != 1:
            raise argument_error("around", "be one plant of the same model", repr(around)[:80])
        about = jnp.broadcast_to(around.values, (n, *numbers))
    return check(TransferPlants(one(trial), trial, model, _checked_spread(spread), about))


def from_draws(model: PlantModel, draws, *, trial=None, spread: float = 1.0) -> TransferPlants:
    """Plants from given standard normal draws; zeros give the nominal plant.

    Args:
        draws: (p,) or (T, p).
        trial: (T,) trial numbers; 0, 1, ... by default.
        spread: factor on the standard deviations [-].

    Raises:
        InputError: for a wrong shape, a value that is not finite, or a plant without a stable modal
            form.
    """
    draws = _rows("draws", draws, model)
    trial = jnp.arange(draws.shape[0]) if trial is None else jnp.asarray(trial)
    return check(TransferPlants(draws, trial, model, _checked_spread(spread)))


def table(model: PlantModel, values, *, trial=None) -> TransferPlants:
    """Plants from a table of their parameters.

    Args:
        values: (p,) or (T, p) physical parameters.
        trial: (T,) trial numbers; 0, 1, ... by default.

    Raises:
        InputError: as ``from_draws``.
    """
    values = _rows("values", values, model)
    trial = jnp.arange(values.shape[0]) if trial is None else jnp.asarray(trial)
    return check(TransferPlants(jnp.zeros_like(values), trial, model, 1.0, values), "values")


def check(plants: TransferPlants, name: str = "draws") -> TransferPlants:
    """Refuse draws that are not finite, and plants without a stable modal form.

    Args:
        plants: the batch; what is traced passes.
        name: of the argument that gave it.

    Raises:
        InputError: naming the first such trial, its entry and its pole.
    """
    if any(isinstance(x, jax.core.Tracer) for x in jax.tree.leaves(plants)):
        return plants
    names, values = plants.model.uncertainty.names, np.asarray(plants.values)
    bad = np.argwhere(~np.isfinite(values))
    if bad.size:
        row, column = bad[0]
        raise argument_error(
            name, "be finite", f"{values[row, column]} for {names[column]} in row {row}"
        )
    batch = batch_of(plants.model, values, nominal_of(plants.model).kept, xp=np)
    if problem := first_problem(plants.model.dynamics.matrix(batch)):
        row, what = problem
        given = ", ".join(f"{n} = {v:.6g}" for n, v in zip(names, values[row], strict=True))
        raise InputError(
            f"Argument `{name}` must give stable plants in modal form, but {what} in row {row} "
            f"(trial {int(plants.trial[row])}: {given}); make the spread smaller, or leave this "
            "plant out."
        )
    return plants


def _rows(name: str, given, model: PlantModel) -> jax.Array:
    """(T, p) numbers from what a user gave, one plant or several."""
    check_runtime()
    if isinstance(given, jax.core.Tracer):
        rows = given
    else:
        rows = as_numbers(given)
    names = model.uncertainty.names
    if rows.ndim not in (1, 2) or rows.shape[-1] != len(names) or 0 in rows.shape[:-1]:
        raise argument_error(
            name, f"have shape ({len(names)},) or (trials, {len(names)})", f"shape {rows.shape}",
            f"The columns are {', '.join(names)}." if names else "No parameter is uncertain.",
        )  # fmt: skip
    return jnp.asarray(rows, dtype=float).reshape((1,) * (2 - rows.ndim) + rows.shape)


def _checked_spread(spread):
    if isinstance(spread, jax.core.Tracer):
        return spread
    value = as_numbers(spread)
    if value.ndim or not 0 <= value < np.inf:
        raise argument_error("spread", "be zero or positive and finite", repr(spread)[:80])
    return float(value)
