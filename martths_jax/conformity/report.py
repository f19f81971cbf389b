"""What the checks of a controller found: one line a check, as a table and as JSON."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from martths_jax._version import __version__
from martths_jax.screen import ScreenTable
from martths_jax.text import counted

#: What a finding is called in tables.
WORDS = {True: "passed", False: "FAILED", None: "not judged"}


@dataclass(frozen=True)
class Finding:
    """What one check found.

    Attributes:
        name: of the check.
        passed: None where it was not judged.
        value: what was measured, None where nothing was; unit: of it, "" for none.
        sentence: what holds; where it does not, what to change; why it was not judged.
    """

    name: str
    passed: bool | None
    value: float | None
    sentence: str
    unit: str = ""

    @property
    def shown(self) -> str:
        """The value with its unit, a dash without one."""
        if self.value is None:
            return "–"
        return f"{self.value:.4g} {self.unit}".rstrip()


@dataclass(frozen=True)
class Report:
    """All findings about a controller.

    Attributes:
        controller: its name; seed: of the plants, the noise and the strokes.
        motion: name of the ground motion; quick: whether the runs of the whole loop were left out.
        findings: in the order of the checks.
    """

    controller: str
    seed: int
    motion: str
    quick: bool
    findings: tuple[Finding, ...]

    def __getitem__(self, name: str) -> Finding:
        """The finding of a check.

        Raises:
            KeyError: there is no such check.
        """
        return {finding.name: finding for finding in self.findings}[name]

    @property
    def passed(self) -> bool:
        """Whether no check failed."""
        return not self.failed

    @property
    def failed(self) -> tuple[Finding, ...]:
        """The findings that failed."""
        return tuple(finding for finding in self.findings if finding.passed is False)

    @property
    def verdict(self) -> str:
        """One line: how many failed, and which; how many were not judged."""
        unjudged = sum(finding.passed is None for finding in self.findings)
        rest = f", {unjudged} not judged" if unjudged else ""
        checks = counted(len(self.findings), "check")
        if self.passed:
            return f"{self.controller}: none of {checks} failed{rest}."
        names = ", ".join(finding.name for finding in self.failed)
        return f"{self.controller}: {len(self.failed)} of {checks} failed ({names}){rest}."

    def table(self) -> ScreenTable:
        """For a terminal of any width."""
        rows = [(f.name, WORDS[f.passed], f.shown, f.sentence) for f in self.findings]
        title = f"{self.controller}: seed {self.seed}, {self.motion}"
        heads = ("check", "result", "value", "what it says")
        return ScreenTable(title, heads, rows, text=("result", "what it says"))

    def as_dict(self) -> dict[str, Any]:
        """As JSON can hold it: a value that is not finite is a text."""
        return {
            "controller": self.controller,
            "passed": self.passed,
            "quick": self.quick,
            "seed": self.seed,
            "motion": self.motion,
            "version": __version__,
            "findings": [
                {"name": f.name, "passed": f.passed, "value": _plain(f.value), "unit": f.unit,
                 "sentence": f.sentence}
                for f in self.findings
            ],
        }  # fmt: skip


def in_words(error: Exception) -> str:
    """An error of a user's code: its kind, and the first line of what it says."""
    first = next(iter(str(error).strip().splitlines()), "").rstrip(".")
    return f"{type(error).__name__} ({first[:160]})" if first else type(error).__name__


def _plain(value: float | None) -> float | str | None:
    return str(value) if value is not None and not math.isfinite(value) else value
