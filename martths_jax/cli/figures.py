"""``martths figures``, ``table``, ``report`` and ``replay``: a study for papers and for looking."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from martths_jax.cli.console import console, error_console
from martths_jax.cli.motion_options import Records
from martths_jax.cli.study import Folder
from martths_jax.files import atomic
from martths_jax.study import Lines, open_study
from martths_jax.text import counted

Trial = Annotated[
    int, typer.Option("--trial", min=0, help="Whose histories are drawn; 0 = nominal plant.")
]
Only = Annotated[
    list[str] | None, typer.Option("--only", help="Figures whose names begin so, as fig14.")
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
    only: Only = None,
    dpi: Annotated[int, typer.Option("--dpi", min=50, max=1200, help="Of the PNG files.")] = 300,
) -> None:
    """Draw the paper's figures and more: PDF, PNG and CSV of what is drawn, one each."""
    from martths_jax.figures import draw_figures

    out = out or folder / "figures"
    paths = draw_figures(
        folder, out, trial=trial, motion=motion, only=only or (), dpi=dpi, progress=_tell
    )
    _say(f"Wrote {counted(len(paths), 'file')} to {out}")


def _tell(name: str) -> None:
    error_console.print(f"drew {name}", highlight=False, markup=False)


def _say(text: str) -> None:
    console.print(text, highlight=False, soft_wrap=True, markup=False)


def table(
    folder: Folder,
    style: Annotated[str, typer.Option("--format", help="md, tex (booktabs) or csv.")] = "md",
    out: Annotated[
        Path | None, typer.Option("--out", help="File to write instead of the screen.")
    ] = None,
) -> None:
    """Table 4 with our columns beside the published ones, and percentiles over the plants."""
    from martths_jax.report import render

    text = render(open_study(folder).dataset, style)
    if out is None:
        print(text, end="")
        return
    with atomic(out) as part:
        part.write_text(text, encoding="utf-8")
    _say(f"Wrote {out}")


def report(
    folder: Folder,
    out: Annotated[
        Path | None, typer.Option("--out", help="File to write [FOLDER/report.html].")
    ] = None,
    trial: Trial = 0,
    only: Only = None,
    beside: Annotated[
        list[Path] | None,
        typer.Option(
            "--beside", help="Folder of a sweep, sensitivity study or tuning to show; repeatable."
        ),
    ] = None,
) -> None:
    """Write one HTML file to look through a study: tables, figures, all trials, histories."""
    from martths_jax.report import write_report

    path = write_report(
        folder, out, trial=trial, only=only or (), beside=beside or (), progress=_tell
    )
    _say(f"Wrote {path} ({path.stat().st_size / 1e6:.1f} MB)")


def replay(
    folder: Folder,
    trial: Annotated[int, typer.Option("--trial", min=0, help="Which; 0 = nominal plant.")],
    records: Records = None,
    with_report: Annotated[
        bool, typer.Option("--report/--no-report", help="Write the report anew.")
    ] = True,
) -> None:
    """Run one trial again bit for bit, keep all its signals, and add it to the report."""
    from martths_jax.report import replay as run_again
    from martths_jax.report import write_report

    done = run_again(
        folder,
        trial,
        records=None if records is None else str(records),
        reporter=Lines(error_console),
    )
    if done.differing:
        for controller, motion, index in done.differing:
            _say(f"{controller} on {motion}: {index} is not what the study holds")
        _say("The study ran with another processor, JAX or code; its numbers are left as they are.")
        raise typer.Exit(1)
    _say(f"Trial {trial}: every index has the study's bits; its signals are in {folder}/signals.nc")
    if with_report:
        path = write_report(folder, progress=_tell)
        _say(f"Wrote {path}")
