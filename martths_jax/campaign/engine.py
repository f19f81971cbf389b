"""The one place where a study touches the simulation's inside: chunks of trials through the loop.

``simulate`` would do, but it draws the noise anew in every call; here the noise of a chunk is drawn
once and serves every motion and controller.  The numbers are the same to the last bit.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import jax
import jax.numpy as jnp
import numpy as np

from martths_jax.campaign.plan import Plan
from martths_jax.errors import InputError
from martths_jax.indices import final_indices
from martths_jax.runtime import check_precision
from martths_jax.simulation import (
    LANES,
    Ran,
    Setup,
    draw_on,
    fill,
    prepare,
    reference_response,
    run_block,
)
from martths_jax.watch import NEVER, Status, status_of

#: First samples that a ``Watch`` holds, by the name they have in the results.
FIRSTS = ("saturated", "command", "stroke", "nonfinite")


#: Begins the names of columns that hold what controllers count.
COUNT = "count_"


@dataclass(frozen=True)
class Outcome:
    """What a chunk of T trials gave under one controller and motion.

    Attributes:
        value: (T, n) indices, NaN where the trial diverged.
        status: (T,) ``Status``.
        first: (T, 4, 2) first samples at which ``FIRSTS`` happened, NaN for never; by actuator.
        volt_peak: (T, 2) largest valve commands [V].
        counts: (T,) what the controller counted, by the name of its signal.
        names: of the n indices.
    """

    value: np.ndarray
    status: np.ndarray
    first: np.ndarray
    volt_peak: np.ndarray
    counts: dict[str, np.ndarray]
    names: tuple[str, ...]

    def __getitem__(self, which) -> Outcome:
        return Outcome.of({k: x[which] for k, x in self.arrays().items()}, self.names)

    def arrays(self) -> dict[str, np.ndarray]:
        """The arrays by the names of their columns."""
        own = {name: getattr(self, name) for name in COLUMNS}
        return own | {COUNT + name: x for name, x in self.counts.items()}

    @classmethod
    def of(cls, arrays: Mapping[str, np.ndarray], names: Iterable[str]) -> Outcome:
        """From the arrays by the names of their columns, and the names of the indices."""
        counts = {k.removeprefix(COUNT): x for k, x in arrays.items() if k.startswith(COUNT)}
        return cls(*(arrays[name] for name in COLUMNS), counts, tuple(names))

    @classmethod
    def join(cls, parts: list[Outcome]) -> Outcome:
        """Trials after trials."""
        columns = [p.arrays() for p in parts]
        whole = {name: np.concatenate([c[name] for c in columns]) for name in columns[0]}
        return cls.of(whole, parts[0].names)


#: Columns of every outcome.
COLUMNS = ("value", "status", "first", "volt_peak")


def choose_devices(wanted: int | None) -> list:
    """Devices of this process to run on.

    Raises:
        InputError: if there are fewer than `wanted`.
    """
    local = jax.local_devices()
    if wanted is not None and wanted > len(local):
        raise InputError(
            f"Argument `devices` must be at most {len(local)}, the devices JAX started with, but "
            f"got {wanted}; set MARTHS_DEVICES={wanted} before Python starts."
        )
    return local[:wanted]


class Engine:
    """Runs chunks of a plan's trials on some devices.

    Args:
        plan: what to run.
        devices: of this process.
        chunk: trials that share one drawing of noise, a multiple of a block.
    """

    def __init__(self, plan: Plan, devices: list, chunk: int):
        self.plan, self.devices, self.chunk = plan, devices, chunk
        self.indices = plan.indices
        self.setups: dict[tuple[str, str], Setup] = {}
        self.longest = max(m.acceleration.size for m in plan.motions)
        self._noise: dict[bytes, list] = {}

    @property
    def block(self) -> int:
        """Trials that run side by side."""
        return LANES * len(self.devices)

    def setup(self, controller: str, motion: str) -> Setup:
        """What all blocks of a controller and motion share; built when first asked for."""
        key = controller, motion
        if key not in self.setups:
            chosen = next(m for m in self.plan.motions if m.name == motion)
            ready, own = prepare(self.plan.controllers[controller], self.plan.benchmark, 1)
            same = next((s for (_, m), s in self.setups.items() if m == motion), None)
            ground = same.ground if same else jnp.asarray(chosen.acceleration)
            response = same.reference if same else reference_response(self.plan.benchmark, ground)
            self.setups[key] = Setup(self.plan.benchmark, ready, own, ground, response)
        return self.setups[key]

    def warm(self, controllers: Iterable[str], trial: np.ndarray) -> None:
        """Compile the programs of these controllers side by side; `trial`: the first chunk."""
        motion = self.plan.motions[0].name
        setups = [self.setup(c, motion) for c in dict.fromkeys(controllers)]
        noise, which = self.noise(trial)[0], np.arange(min(trial.size, self.block))
        plants = self.plan.draws.plants(trial)

        def compile_one(setup: Setup) -> None:
            check_precision()  # a block `with jax.enable_x64()` does not reach this thread
            # A motion of one sample: the programs do not depend on its length.
            brief = replace(setup, ground=setup.ground[:1], reference=setup.reference[:1])
            run_block(brief, plants, noise, which, self.devices, False, False, self.indices)

        with ThreadPoolExecutor(len(setups)) as pool:
            list(pool.map(compile_one, setups))

    def noise(self, trial: np.ndarray) -> list[jax.Array]:
        """Noise of a chunk, block by block, for the longest motion; forgets the chunk before."""
        key = trial.tobytes()
        if key not in self._noise:
            self._noise = {}  # free the old chunk's memory before drawing
            self._noise[key] = self._drawn(trial, self.devices)
        return self._noise[key]

    def _drawn(self, trial: np.ndarray, devices: list) -> list:
        size = LANES * len(devices)
        positions = np.arange(trial.size)
        return [
            draw_on(devices, self.plan.noise, trial[fill(positions[i : i + size], size)],
                    self.longest, self.plan.benchmark.fs)
            for i in range(0, trial.size, size)
        ]  # fmt: skip

    def run(self, controller: str, motion: str, trial: np.ndarray) -> Outcome:
        """Run the trials (T,) of a chunk."""
        setup = self.setup(controller, motion)
        plants = self.plan.draws.plants(trial)
        blocks = []
        for i, noise in enumerate(self.noise(trial)):
            which = np.arange(i * self.block, min((i + 1) * self.block, trial.size))
            ran = run_block(
                setup, plants, noise, which, self.devices, keep=False, indices=self.indices
            )
            blocks.append(self.outcome(ran, which.size))
        return Outcome.join(blocks)

    def signals(self, controller: str, motion: str, trial: np.ndarray, device) -> dict:
        """Signals (T, N, ...) of at most ``LANES`` trials, run again on one device."""
        setup = self.setup(controller, motion)
        noise = self._drawn(trial, [device])[0]
        which = np.arange(trial.size)
        plants = self.plan.draws.plants(trial)
        return run_block(
            setup, plants, noise, which, [device], keep=True, indices=self.indices
        ).signals

    def outcome(self, ran: Ran, trials: int) -> Outcome:
        """What a block of so many trials comes to."""
        # As many trials in every block, so that the few operations here compile once.
        lanes = fill(np.arange(trials), self.block)
        sums, watch, counts = jax.tree.map(lambda x: np.asarray(x)[..., lanes], ran[:3])
        status = np.asarray(status_of(watch, sums))
        found = final_indices(sums, status >= Status.DIVERGED)
        first = np.stack([np.asarray(getattr(watch, name)) for name in FIRSTS])
        whole = Outcome(
            value=np.stack(list(found.values()), axis=-1),
            status=status.astype(np.int32),
            first=np.moveaxis(np.where(first >= NEVER, np.nan, first), -1, 0),
            volt_peak=np.asarray(watch.volt_peak).T,
            counts={name: x.astype(np.int32) for name, x in counts.items()},
            names=tuple(found),
        )
        return whole[:trials]
