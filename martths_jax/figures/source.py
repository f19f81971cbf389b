"""What the figures are drawn from: a finished study, one trial's histories, one chosen motion."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np

from martths_jax.campaign.dataset import index_names, problem_of, unit_of, units
from martths_jax.errors import InputError
from martths_jax.figures.style import Names
from martths_jax.layout import Layout
from martths_jax.problem import Problem
from martths_jax.study import Study, open_study

#: Axes of a signal that holds the coefficients of a command.
COEFFICIENTS = ("coefficient", "actuator")
#: Zoom windows of the benchmark's plots [s], by the record's name (benchmark's plotting scripts).
ZOOM = {
    "elcentro": ((7.0, 8.0), (14.0, 15.0), (31.0, 32.0)),
    "kobe": ((8.5, 9.5), (10.0, 12.0), (14.0, 15.0)),
    "morganhill": ((7.0, 8.0), (9.5, 11.0), (11.3, 13.0)),
}


@dataclass
class Source:
    """A study as the figures see it.

    Attributes:
        study: the results.
        trial: whose histories are drawn, 0 = nominal plant.
        motion: of the figures that show one motion.
    """

    study: Study
    trial: int
    motion: str
    _read: dict = field(default_factory=dict, repr=False)

    @cached_property
    def problem(self) -> Problem:
        """What was tested."""
        return problem_of(self.study.dataset)

    @property
    def layout(self) -> Layout:
        """Names and sizes of the problem."""
        return self.problem.layout

    def plants(self, nominal: bool = False):
        """The uncertain plants of the study, or the nominal one."""
        data = self.study.dataset
        chosen = slice(0, 1) if nominal else slice(1, None)
        spread = float(json.loads(data.attrs["identity"])["spread"])
        return self.problem.plants(data.draw.values[chosen], data.trial.values[chosen], spread)

    @property
    def controllers(self) -> list[str]:
        """Names of the controllers, in the study's order."""
        return [str(c) for c in self.study.dataset.controller.values]

    @cached_property
    def names(self) -> Names:
        """How the controllers are called and drawn."""
        return Names(self.study.dataset)

    @property
    def motions(self) -> list[str]:
        """Names of the motions, in the study's order."""
        return [str(m) for m in self.study.dataset.motion.values]

    @property
    def indices(self) -> list[str]:
        """Names of the indices, in the study's order."""
        return index_names(self.study.dataset)

    @cached_property
    def units(self) -> dict[str, list[str]]:
        """Units -> the indices that have them."""
        return units(self.study.dataset)

    def unit(self, index: str) -> str:
        """Unit of an index."""
        return unit_of(self.study.dataset, index)

    def coefficients(self, controller: str, motion: str) -> np.ndarray | None:
        """(N, 4 n, n) what a controller calls the coefficients of its command, stroke by stroke
        those of its derivatives; None without."""
        n = len(self.layout.actuators)
        stored = self.study.signals(motion, controller)
        for name, variable in stored.data_vars.items():
            if variable.dims[2:] == COEFFICIENTS and variable.shape[2:] == (4 * n, n):
                return self.history(controller, motion)[name]
        return None

    @property
    def fs(self) -> float:
        """Sampling rate [Hz]."""
        return float(np.ravel(self.study.dataset.attrs["fs"])[0])

    @property
    def who(self) -> str:
        """The trial in words."""
        return "nominal plant" if self.trial == 0 else f"trial {self.trial}"

    def position(self, controller: str) -> int:
        """Which look a controller has (see ``style.look``)."""
        return self.names.position(controller)

    def label(self, controller: str) -> str:
        """What a controller is called in legends."""
        return self.names.label(controller)

    def values(self, controller: str, motion: str, index: str) -> np.ndarray:
        """(trials,) index of the uncertain trials, NaN where one diverged."""
        cell = self.study.dataset.value.sel(controller=controller, motion=motion, index=index)
        return cell.values[1:]

    def shared(self, motion: str):
        """Time, ground acceleration and reference response of a motion."""
        if motion not in self._read:
            self._read[motion] = self.study.signals(motion)
        return self._read[motion]

    def history(self, controller: str, motion: str) -> dict[str, np.ndarray]:
        """Signals (N, ...) of the trial; ``InputError`` if the study has not kept them."""
        key = controller, motion
        if key not in self._read:
            stored = self.study.signals(motion, controller)
            kept = stored.trial.values.tolist()
            if self.trial not in kept:
                raise InputError(
                    f"{self.study.folder} keeps no signals of trial {self.trial} ({controller} on "
                    f"{motion}; kept are {', '.join(map(str, kept))}); `martths replay "
                    f"{self.study.folder} --trial {self.trial}` adds them."
                )
            chosen = stored.isel(kept=kept.index(self.trial))
            self._read[key] = {
                name: v.values for name, v in chosen.data_vars.items() if "time" in v.dims
            }
        return self._read[key]

    def zoom_windows(self, motion: str) -> tuple[tuple[float, float], ...]:
        """Three windows [s]: the benchmark's, or about the largest strokes of each third."""
        known = ZOOM.get(motion.removesuffix("-like"))
        time = self.shared(motion).time.values
        if known and time[-1] > known[-1][1]:
            return known
        stroke = np.max(np.abs(self.history(self.controllers[-1], motion)["x_a"]), axis=1)
        width = min(1.0, time[-1] / 6)
        found = []
        for third in np.array_split(np.arange(time.size), 3):
            middle = time[third[np.argmax(stroke[third])]]
            first = float(np.clip(middle - width / 2, time[third[0]], time[third[-1]] - width))
            found.append((first, first + width))
        return tuple(found)


def open_source(folder: Path | str, trial: int = 0, motion: str | None = None) -> Source:
    """Open a study for drawing.

    Args:
        folder: of a finished study.
        trial: whose histories are drawn.
        motion: of the figures that show one motion; El Centro if it is there, else the first.

    Raises:
        InputError: no such study or motion.
    """
    study = open_study(folder)
    names = [str(m) for m in study.dataset.motion.values]
    if motion is None:
        motion = next((n for n in names if n.startswith("elcentro")), names[0])
    if motion not in names:
        raise InputError(f"Motion {motion!r} is not in {folder}; it has {', '.join(names)}.")
    return Source(study, trial, motion)
