"""What a campaign is to the run: cells in batches, batches in blocks of lanes, rows in chunks.

A *cell* is what is stored together: a controller, or one with its settings, under a motion, with
one row a trial.  A *batch* is cells that share a program, a *lane* one row of one of its cells, a
*block* the lanes that run side by side.  A study, a sweep and a sensitivity analysis are each a
``Campaign``: which cells there are, how their rows fill blocks, and what is made of the results;
``run.run_campaign`` runs any of them.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from martths_jax.campaign.engine import Engine, Outcome, choose_devices
from martths_jax.campaign.memory import GB, choose_chunk, lane_bytes, running_bytes
from martths_jax.campaign.plan import Plan
from martths_jax.campaign.progress import Reporter, Tally
from martths_jax.campaign.session import header
from martths_jax.campaign.store import RunFolder
from martths_jax.simulation import LANES
from martths_jax.text import counted

#: Name of what is run and name of the motion, as the parts of a folder have them.
Cell = tuple[str, str]


@dataclass(frozen=True)
class Block:
    """Lanes that run side by side.

    Attributes:
        key: (controller, motion) whose progress they are.
        lanes: (L,) their numbers in the batch: cell after cell, the rows of the chunk in each.
        run: gives their ``Outcome``.
    """

    key: Cell
    lanes: np.ndarray
    run: Callable[[], Outcome]


class Batch(ABC):
    """Cells that run together.

    Attributes:
        cells: their names; no other batch has them.
    """

    cells: tuple[Cell, ...]

    @abstractmethod
    def blocks(self, engine: Engine, chunk: np.ndarray) -> Iterator[Block]:
        """Blocks of all lanes under the rows (T,) of a chunk, which do not depend on what is done
        already: a lane has the same neighbours however often the run was interrupted."""


class Campaign(ABC):
    """Which cells are run, and what comes of them.

    Args:
        plan: of the study behind it.
    """

    #: The kind of its folder.
    folder: type[RunFolder] = RunFolder

    def __init__(self, plan: Plan):
        self.plan = plan

    @property
    def keys(self) -> list[Cell]:
        """(controller, motion) whose progress is shown, in the order of the results."""
        return [(c, m.name) for m in self.plan.motions for c in self.plan.controllers]

    @property
    def samples(self) -> int:
        """Length of the longest motion."""
        return max(m.acceleration.size for m in self.plan.motions)

    @property
    def notices(self) -> list[str]:
        """Sentences a user should read before it runs."""
        return self.plan.notices

    def header(self, command_line: str) -> dict:
        """What ``run.json`` says of it."""
        return header(self.plan, command_line)

    def make_engine(self, reporter: Reporter) -> Engine:
        """Engine on as many devices as memory allows; says how much there is to run."""
        config, channels = self.plan.config, self.plan.noise.channels
        devices = choose_devices(config.devices)
        running = running_bytes(self.plan.indices, config.fs)
        count, lanes = choose_chunk(
            self.samples, channels, LANES, len(devices), config.memory_gb, running
        )
        engine = self.engine_on(devices[:count], lanes)
        size = self.noise_lanes(engine) * lane_bytes(self.samples, channels) / GB
        where = counted(count, f"{devices[0].platform} device")
        reporter.notice(
            f"Seed {config.seed}; {self.extent} on {where}, {self.pace(engine)} "
            f"(about {size:.2g} GB)."
        )
        for text in self.notices:
            reporter.notice(text)
        return engine

    def engine_on(self, devices: list, lanes: int) -> Engine:
        """Engine on some devices whose memory holds the noise of so many lanes."""
        return Engine(self.plan, devices, lanes)

    def noise_lanes(self, engine: Engine) -> int:
        """Lanes whose noise is kept at a time."""
        return engine.chunk

    @property
    @abstractmethod
    def extent(self) -> str:
        """How much is run, in words."""

    @abstractmethod
    def pace(self, engine: Engine) -> str:
        """In what pieces, in words."""

    @abstractmethod
    def batches(self) -> list[Batch]:
        """All cells, in the order they are run within a chunk."""

    def tallies(self, asked: np.ndarray, left: dict[Cell, np.ndarray]) -> dict[Cell, Tally]:
        """How far each of ``keys`` is.

        Args:
            asked: (rows,) whether a row is this process's.
            left: for each cell, (rows,) whether it is still to be run.
        """
        found = {key: Tally(0, 0) for key in self.keys}
        for cell, waiting in left.items():
            tally = found[self.key_of(cell)]
            tally.total += int(asked.sum())
            tally.done += int(asked.sum() - waiting.sum())
        return found

    def key_of(self, cell: Cell) -> Cell:
        """(controller, motion) of a cell."""
        return cell

    def warm(self, engine: Engine, left: dict[Cell, np.ndarray], reporter: Reporter) -> None:  # noqa: B027
        """Whatever is better done before the first chunk; nothing by default."""

    def chunks(self, engine: Engine, left: dict[Cell, np.ndarray]) -> Iterator[np.ndarray]:
        """(T,) rows that are run together, so that their noise is drawn once."""
        rows = next(iter(left.values())).size
        size = self.rows_of(engine)
        for first in range(0, rows, size):
            yield np.arange(first, min(first + size, rows))

    def rows_of(self, engine: Engine) -> int:
        """Rows in a chunk."""
        return engine.chunk

    @abstractmethod
    def finish(self, run: RunFolder, engine: Engine, reporter: Reporter):
        """Write the result files of a complete run; what the user gets."""
