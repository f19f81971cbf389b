"""The options that say which ground motions a command runs on, the same for every command.

def run(motion: Motions, records: Records = None, scale: Scale = None, ...):
    for one in load_all(motion, records, scale, pga, sa, units, resample, fs): ...
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from rich.markup import escape

from martths_jax.cli.console import console
from martths_jax.cli.options import setting
from martths_jax.motions import DEFAULT_SCALE, Motion, load_motion

Motions = setting("motions")
Records = setting("records", "$MARTHS_RECORDS")
Scale = setting("scale", DEFAULT_SCALE)
Pga = setting("pga")
Sa = setting("sa")
Units = setting("units")
Dt = setting("dt")
Variable = setting("variable")
Resample = setting("resample", "linear")


def load_all(
    motions: Sequence[str],
    records: Path | None = None,
    scale: float | None = None,
    pga: str | None = None,
    sa: str | None = None,
    units: str | None = None,
    resample: str | None = None,
    fs: float = 1024,
    dt: float | None = None,
    variable: str | None = None,
) -> list[Motion]:
    """Every motion of a command, from the values of its options; prints their notices."""
    found = [
        load_motion(
            motion,
            scale=DEFAULT_SCALE if scale is None else scale,
            fs=fs,
            records=records,
            units=units,
            pga=pga,
            sa=sa,
            resample=resample or "linear",
            dt=dt,
            variable=variable,
        )
        for motion in motions
    ]
    for notice in (notice for one in found for notice in one.notices):
        console.print(f"[yellow]Note:[/] {escape(notice)}", highlight=False, soft_wrap=True)
    return found
