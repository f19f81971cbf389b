"""The folder of an analysis: that of a study, whose trials are the rows of the design."""

from __future__ import annotations

from martths_jax.campaign.store import OWN, RunFolder
from martths_jax.errors import InputError

#: Stands for the motion in the names of the parts: rows of all motions are stored together.
ROWS = "rows"
RESULTS = ("sensitivity.nc", "sensitivity.csv")


class SensitivityFolder(RunFolder):
    """An analysis's folder; base sample after base sample, so N may grow."""

    own = (*OWN, *RESULTS)
    what = "sensitivity analysis"

    def _continue(self, asked: dict, allow_mixed: bool, notice) -> None:
        each = len(asked["identity"]["factors"]) + 2
        if self.header["identity"].get("factors") == asked["identity"]["factors"]:
            there, here = ((h["trials"] + 1) // each for h in (self.header, asked))
            if here < there:
                raise InputError(
                    f"{self.path} holds an analysis of N = {there} base samples, but {here} were "
                    "asked for; it can be extended, not shortened.  Give another --out "
                    "(`out`), or --fresh (`fresh=True`) to start over."
                )
        super()._continue(asked, allow_mixed, notice)
