"""``martths figures``, ``table``, ``report`` and ``replay``: a study for papers and for looking."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from martths_jax.cli.console import console, error_console
from martths_jax.cli.study import Folder

Out = Annotated[Path | None, typer.Option("--out", help="Where to write [the study's folder].")]
Trial = Annotated[
    int, typer.Option("--trial", min=0, help="Whose histories are drawn; 0 = nominal plant.")
]


def figures(
    folder: Folder,
    out: Annotated[
        Path | None, typer.Option("--out", help="Folder of the figures [FOLDER/figures].")
    ] = None,
    trial: Trial = 0,
    motion: Annotated[
        str | None, typer.Option("--motion", help="Motion of the figures that show one.")
    ] = None,
    only: Annotated[
        list[str] | None, typer.Option("--only", help="Figures whose names begin so, as fig14.")
    ] = None,
    dpi: Annotated[int, typer.Option("--dpi", min=50, max=1200, help="Of the PNG files.")] = 300,
) -> None:
    """Draw the paper's figures and more: PDF, PNG and CSV of what is drawn, one each."""
    from martths_jax.figures import draw_figures

    out = out or folder / "figures"
    paths = draw_figures(
        folder, out, trial=trial, motion=motion, only=only or (), dpi=dpi, progress=_tell
    )
    _say(f"{len(paths)} files are in {out}")


def _tell(name: str) -> None:
    error_console.print(f"drew {name}", highlight=False, markup=False)


def _say(text: str) -> None:
    console.print(text, highlight=False, soft_wrap=True, markup=False)
