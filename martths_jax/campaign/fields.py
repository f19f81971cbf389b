"""Every setting of a study, once: its section and name in TOML, what it may be, what it means."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from martths_jax.benchmark import FORCE_FROM, PARTITIONS
from martths_jax.control.registry import names as known
from martths_jax.indices import GROUPS
from martths_jax.problem import PROBLEMS
from martths_jax.structure.integrators import INTEGRATORS

DRAWS = ("independent", "lhs", "sobol")
#: Trials are numbered in 32 bits; the larger half of the numbers is for the noise of sensitivity
#: analyses.
MOST_TRIALS = 2**30 - 1
CSV_KINDS = ("auto", "draws", "hz", "rad/s", "values")


@dataclass(frozen=True)
class Field:
    """One setting.

    Attributes:
        name: attribute of ``StudyConfig``, and key in TOML.
        section: table in TOML.
        good: whether a value can be used.
        wanted: what it must be, to complete "must ...".
        help: comment in the file that ``martths init-config`` writes.
    """

    name: str
    section: str
    good: Callable[[Any], bool]
    wanted: str
    help: str


def is_whole(value, low: int = 0, high: int = MOST_TRIALS) -> bool:
    """Whether `value` is a whole number (not a bool) from `low` to `high`."""
    return isinstance(value, int) and not isinstance(value, bool) and low <= value <= high


def is_number(value) -> bool:
    """Whether `value` is a finite number (not a bool)."""
    good = isinstance(value, (int, float)) and not isinstance(value, bool)
    return good and abs(value) <= sys.float_info.max  # an integer may be beyond any float


def is_positive(value) -> bool:
    """Whether `value` is a finite number above zero."""
    return is_number(value) and value > 0


def optional(test: Callable[[Any], bool]) -> Callable[[Any], bool]:
    """The same test, which None passes too."""
    return lambda value: value is None or test(value)


def one_of(names) -> Callable[[Any], bool]:
    """Test for membership that survives unhashable values."""
    return lambda value: value in list(names)


def _is_text(value) -> bool:
    return isinstance(value, str) and value != ""


def _is_list(value) -> bool:
    return isinstance(value, (tuple, list)) and len(value) > 0


def _are_trials(value) -> bool:
    return isinstance(value, (tuple, list)) and all(is_whole(v) for v in value)


_bool = lambda value: isinstance(value, bool)  # noqa: E731
_choice = lambda names: f"be one of {', '.join(names)}"  # noqa: E731

FIELDS = (
    Field("trials", "study", lambda v: is_whole(v, 1),
          f"be a whole number from 1 to {MOST_TRIALS}",
          "Number of uncertain plants; the nominal plant runs beside them as trial 0."),
    Field("seed", "study", lambda v: is_whole(v, 0, 2**63 - 1),
          "be a whole number from 0 to 2^63 - 1",
          "Plant and sensor noise of trial i depend on (seed, i) alone."),
    Field("problem", "study", _is_text, _choice(PROBLEMS),
          f"What is tested: {', '.join(PROBLEMS)}, or a file that `martths problem init` writes."),
    Field("case", "study", optional(lambda v: is_whole(v, 1)), "be the number of a case",
          "Case of a problem that has several; left out: the first."),
    Field("controllers", "study", _is_list, "be a list of at least one controller",
          f"Controllers to compare: {', '.join(known())}, package.module:Class, file.py:Class, "
          "NAME=KIND{KEY=VALUE,...}, or names of [controller.NAME] tables."),
    Field("indices", "study", _is_list, "be a list of at least one index",
          f"What is evaluated: groups ({', '.join(GROUPS)}), names such as J2_1 or TI, or "
          "package.module:NAME of your own."),
    Field("draws", "study", one_of(DRAWS), _choice(DRAWS),
          "independent (extendable), lhs or sobol (spread evenly; they depend on `trials`)."),
    Field("spread", "study", lambda v: is_number(v) and v >= 0, "be zero or positive",
          "Factor on the standard deviations of the plant's uncertain parameters."),
    Field("plants", "study", optional(_is_text), "be the path of a CSV file",
          "CSV file with the uncertain parameters of each plant, instead of `draws`."),
    Field("plants_as", "study", one_of(CSV_KINDS), _choice(CSV_KINDS),
          "What the numbers of `plants` are; auto reads it from the header."),
    Field("motions", "motions", optional(_is_list), "be a list of at least one motion",
          "Names or paths; left out: the three built-in motions, or the records of `records`."),
    Field("records", "motions", optional(_is_text), "be the path of a folder",
          "Folder of ground motions that are found by name."),
    Field("scale", "motions", lambda v: is_number(v) and v != 0, "be a finite factor but not zero",
          "Factor on the unscaled records."),
    Field("pga", "motions", optional(lambda v: _is_text(v) or is_positive(v)),
          "be a peak acceleration such as 0.4g", "Scale to this peak instead, such as 0.4g."),
    Field("sa", "motions", optional(_is_text), "be a target such as 0.3g@2.29Hz",
          "Scale to this 5 %-damped spectral acceleration instead, such as 0.3g@2.29Hz."),
    Field("units", "motions", optional(one_of(("g", "m/s2", "cm/s2"))), _choice(
          ("g", "m/s2", "cm/s2")), "Unit of files that do not say theirs."),
    Field("dt", "motions", optional(is_positive), "be a positive time step [s]",
          "Time step of files that do not say theirs [s]."),
    Field("variable", "motions", optional(lambda v: _is_text(v) or is_whole(v, 1)),
          "be the name or number of a column", "Column, channel or array of files with several."),
    Field("resample", "motions", one_of(("linear", "bandlimited")),
          _choice(("linear", "bandlimited")), "How records come to the sampling rate."),
    Field("fs", "model", is_positive, "be a positive sampling rate [Hz]", "Sampling rate [Hz]."),
    Field("integrator", "model", one_of(INTEGRATORS), _choice(INTEGRATORS),
          "Integrator of the structures."),
    Field("partition", "model", one_of(PARTITIONS), _choice(PARTITIONS),
          "How the experimental frame is taken out of the reference."),
    Field("force_from", "model", one_of(FORCE_FROM), _choice(FORCE_FROM),
          "Strokes that the restoring force is made from: the controller's, or those measured."),
    Field("noise_power", "model", lambda v: is_number(v) and v >= 0, "be zero or positive [mm^2 s]",
          "Power of the sensor noise [mm^2 s]."),
    Field("noise_shared", "model", _bool, "be true or false",
          "Both sensors see the same noise, as in the benchmark."),
    Field("out", "run", _is_text, "be the path of a folder", "Folder of the results."),
    Field("keep", "run", _are_trials, "be a list of trial numbers",
          "Trials whose signals are stored beside nominal, median and worst."),
    Field("signals", "run", _bool, "be true or false", "Store signals of chosen trials."),
    Field("devices", "run", optional(lambda v: is_whole(v, 1)), "be a whole number of at least 1",
          "Devices to use; left out: all (one per core)."),
    Field("memory_gb", "run", optional(is_positive), "be positive [GB]",
          "Memory that a chunk of trials may take; left out: from what is free."),
    Field("max_failed", "run", optional(is_whole), "be zero or a positive whole number",
          "More diverged trials than this end the command with exit code 1."),
)  # fmt: skip
BY_NAME = {field.name: field for field in FIELDS}
SECTIONS = tuple(dict.fromkeys(field.section for field in FIELDS))
#: Settings that do not change any number of the results.
RUN_ONLY = frozenset(f.name for f in FIELDS if f.section == "run")
