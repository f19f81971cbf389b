"""What a problem is to a campaign: names, sizes, and functions that make its parts."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from martths_jax.guests import FILES, Copy
from martths_jax.layout import Layout
from martths_jax.published import NOTHING, Published
from martths_jax.sensors import SensorNoise

if TYPE_CHECKING:
    from martths_jax.benchmark import Benchmark


class Reading(NamedTuple):
    """A form in which a file may give the uncertain parameters of plants.

    Attributes:
        ending: of the columns' names, after the parameter's.
        draws: (values (T, p), spread) -> standard normal draws (T, p).
    """

    ending: str
    draws: Callable[[np.ndarray, float], np.ndarray]


@dataclass(frozen=True, eq=False)
class Problem:
    """A problem of real-time hybrid simulation.

    Attributes:
        name: short name, for files and options.
        title: what it is, in words.
        paper: where it is defined.
        layout: names and sizes.
        parameters: names of the p uncertain parameters of its plant.
        build: build(fs, integrator, partition=, force_from=, coupler=) -> ``Benchmark``.
        plants: plants(draws (T, p), trial (T,), spread) -> a batch of plants, unchecked.
        draw: draw(n, seed, first=, spread=) -> plants first ... first + n - 1, of which each
            depends on (seed, its number) alone.
        check: refuses a batch of plants that cannot be run.
        readings: forms of parameters in files, by the names that ``plants_as`` takes.
        stored: name, words and unit of the variable that holds the parameters' values.
        noise: noise(power [mm^2 s], shared, seed) -> ``SensorNoise``.
        settings: of a study, where its usual ones are other than the maRTHS benchmark's.
        published: what is printed of its nominal plant, for comparison only.
        partitions: ways to part the structure that it offers.
        files: that it was read from, the problem file first; none for those of this package.
        sha256: digest of those files.
    """

    name: str
    title: str
    paper: str
    layout: Layout
    parameters: tuple[str, ...]
    build: Callable[..., Benchmark]
    plants: Callable[[Any, Any, float], Any]
    draw: Callable[..., Any]
    check: Callable[[Any], Any]
    readings: Mapping[str, Reading]
    stored: tuple[str, str, str]
    noise: Callable[[float, bool, int], SensorNoise] = SensorNoise
    settings: Mapping[str, Any] = field(default_factory=dict)
    published: Published = NOTHING
    partitions: tuple[str, ...] = ("benchmark",)
    files: tuple[Path, ...] = ()
    sha256: str = ""

    @property
    def place(self) -> str:
        """Name by which a run's folder finds it again: its own, or that of a copy of its file."""
        return f"{self._folder}/{self.files[0].name}" if self.files else self.name

    @property
    def copies(self) -> tuple[Copy, ...]:
        """How a run keeps its files, each as far from the problem file as it is."""
        return tuple(
            Copy(file, hashlib.sha256(file.read_bytes()).hexdigest(),
                 f"{self._folder}/{file.relative_to(self.files[0].parent).as_posix()}")
            for file in self.files
        )  # fmt: skip

    @property
    def _folder(self) -> str:
        return f"{FILES}/problem-{self.sha256[:12]}"
