"""``martths export``: results for other tools."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Annotated

import typer
from rich.markup import escape

from martths_jax.campaign.assembly import Results
from martths_jax.campaign.formats import FORMATS, Format
from martths_jax.cli.console import console
from martths_jax.cli.options import option
from martths_jax.cli.study import Signals
from martths_jax.errors import InputError
from martths_jax.sensitivity import open_sensitivity
from martths_jax.study import open_study
from martths_jax.sweep import open_sweep

#: The result file of a kind of campaign -> what reads it.
KINDS: dict[str, Callable[..., Results]] = {
    "sweep.nc": open_sweep,
    "sensitivity.nc": open_sensitivity,
    "study.nc": open_study,
}
Folder = Annotated[
    Path, typer.Argument(help="Folder of a study, a sweep or a sensitivity analysis.")
]


def command(formats: Iterable[Format] = FORMATS) -> Callable[..., None]:
    """The command, with an option for each format."""
    formats = tuple(formats)

    def export(folder: Path, signals: bool = True, **files: Path | None) -> None:
        """Write finished results, signals or plants for other tools."""
        wanted = [(one, files[one.name]) for one in formats if files.get(one.name) is not None]
        if not wanted:
            ways = [f"--{one.name} FILE" for one in formats]
            raise InputError(f"Say what to export: {', '.join(ways[:-1])} or {ways[-1]}.")
        name = next((n for n in KINDS if (folder / n).is_file()), "study.nc")
        done = KINDS[name](folder)
        for one, path in wanted:
            one.write(done, path, signals)
        for _, path in wanted:
            console.print(f"Wrote {escape(str(path))}", highlight=False, soft_wrap=True)

    kinds = {"folder": Folder}
    for one in formats:
        kinds[one.name] = option(Path | None, f"--{one.name}", metavar="FILE", help=one.help)
    kinds["signals"] = Signals
    defaults = {"folder": inspect.Parameter.empty, "signals": True}
    export.__annotations__ = kinds
    export.__signature__ = inspect.Signature([
        inspect.Parameter(
            name, inspect.Parameter.KEYWORD_ONLY, annotation=kind, default=defaults.get(name)
        )
        for name, kind in kinds.items()
    ])  # fmt: skip
    return export
