"""``martths figures``, ``table``, ``report`` and ``replay``: a study for papers and for looking."""

from __future__ import annotations

from pathlib import Path

import typer

from martths_jax.cli.console import console, error_console
from martths_jax.cli.motion_options import Motions, Records
from martths_jax.cli.options import Trial, one_of, option, setting
from martths_jax.cli.study import Folder
from martths_jax.files import atomic
from martths_jax.study import Lines, open_study
from martths_jax.text import counted

Only = option(
    list[str] | None, "--only", metavar="NAME",
    help="Figures whose names begin so, as fig14; repeated or with commas",
)  # fmt: skip


def figures(
    folder: Folder,
    out: setting("out", "a folder, FOLDER/figures") = None,
    trial: Trial = 0,
    motion: Motions = None,
    only: Only = None,
    dpi: option(int, "--dpi", min=50, max=1200, help="Dots an inch of PNG files") = 300,
) -> None:
    """Draw the paper's figures and more: PDF, PNG and CSV of what is drawn, one each."""
    from martths_jax.figures import draw_figures

    out = out or folder / "figures"
    paths = draw_figures(
        folder, out, trial=trial, motion=one_of("--motion", motion), only=only or (), dpi=dpi,
        progress=_tell,
    )  # fmt: skip
    _say(f"Wrote {counted(len(paths), 'file')} to {out}")


def _tell(name: str) -> None:
    error_console.print(f"drew {name}", highlight=False, markup=False)


def _say(text: str) -> None:
    console.print(text, highlight=False, soft_wrap=True, markup=False)


def table(
    folder: Folder,
    style: option(str, "--format", help="md, tex (booktabs) or csv") = "md",
    out: setting("out", "the screen") = None,
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
    out: setting("out", "a file, FOLDER/report.html") = None,
    trial: Trial = 0,
    only: Only = None,
    beside: option(
        list[Path] | None,
        "--beside",
        metavar="DIR",
        help="Folders of sweeps, sensitivity analyses or tunings to show; repeated or with commas",
    ) = None,
) -> None:
    """Write one HTML file to look through a study: tables, figures, all trials, histories."""
    from martths_jax.report import write_report

    path = write_report(
        folder, out, trial=trial, only=only or (), beside=beside or (), progress=_tell
    )
    _say(f"Wrote {path} ({path.stat().st_size / 1e6:.1f} MB)")


def replay(
    folder: Folder,
    trial: Trial,
    records: Records = None,
    with_report: option(bool, "--report/--no-report", help="Write the report anew") = True,
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
