"""``martths study``, ``init-config``, ``merge`` and ``summary``."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated

import typer
from rich.markup import escape

from martths_jax.campaign.config import make_config
from martths_jax.campaign.distributed import JOIN_TIMEOUT, LOST_TIMEOUT, join
from martths_jax.campaign.provenance import command_line
from martths_jax.campaign.template import write_template
from martths_jax.cli.console import console, error_console
from martths_jax.cli.motion_options import Records
from martths_jax.cli.options import DRAWN, STUDY, option, setting, takes
from martths_jax.cli.run_options import (
    AllowMixed,
    Config,
    Fresh,
    Quiet,
    kept,
    reporter_for,
    set_devices,
    settings_of,
)
from martths_jax.errors import InputError, argument_error
from martths_jax.study import Study, merge_runs, open_study, run_study
from martths_jax.text import counted

Folder = Annotated[Path, typer.Argument(help="Folder of a study.")]
Signals = setting("signals")
Keep = setting("keep")


@takes((*STUDY, *DRAWN, "keep", "signals", "memory_gb", "max_failed"))
def study(
    config: Config = None,
    settings: dict | None = None,
    fresh: Fresh = False,
    shard: option(
        str | None, "--shard", metavar="I/N", help="Run the I-th of N shares; merge them after"
    ) = None,
    distributed: option(
        bool, "--distributed", help="Join the cluster's other processes of this job"
    ) = False,
    coordinator: option(str | None, "--coordinator", help="host:port of process 0") = None,
    num_processes: option(
        int | None, "--num-processes", help="How many processes there are"
    ) = None,
    process_id: option(int | None, "--process-id", help="Which of them this is, from 0") = None,
    join_timeout: option(
        float, "--join-timeout", help="Longest wait for the other processes [s]"
    ) = JOIN_TIMEOUT,
    lost_timeout: option(
        float, "--lost-timeout", help="A machine silent for longer is lost [s]"
    ) = LOST_TIMEOUT,
    allow_mixed: AllowMixed = False,
    quiet: Quiet = False,
) -> None:
    """Run controllers x motions x uncertain plants; resumes and extends what is in the folder."""
    chosen = make_config(settings_of(config, settings))
    set_devices(chosen.devices)
    share = _share(shard)
    together = None
    if distributed or any(x is not None for x in (coordinator, num_processes, process_id)):
        if share is not None:
            raise InputError(
                "Options --shard and --coordinator or --distributed exclude each other."
            )
        together = join(coordinator, num_processes, process_id, join_timeout, lost_timeout)
        share = together.share
    with kept(chosen.out):
        done = run_study(
            chosen,
            reporter=reporter_for(quiet),
            fresh=fresh,
            share=share,
            together=together,
            allow_mixed=allow_mixed,
            command_line=command_line(),
        )
    if done is not None:
        _show(done, quiet, chosen.max_failed)
    elif together is None and not quiet:
        console.print(
            f"Share {shard} is done; when all are: martths merge {escape(chosen.out)}",
            highlight=False, soft_wrap=True,
        )  # fmt: skip


def init_config(
    path: Annotated[Path, typer.Argument(help="File to write.")] = Path("study.toml"),
    force: option(bool, "--force", help="Overwrite the file") = False,
) -> None:
    """Write a commented configuration with all defaults."""
    write_template(path, force)
    console.print(f"Wrote {escape(str(path))}", soft_wrap=True)


def merge(
    out: Annotated[Path, typer.Argument(help="Folder of the whole study.")],
    folders: Annotated[
        list[Path] | None, typer.Argument(help="Folders with shares, if not all are in OUT.")
    ] = None,
    records: Records = None,
    signals: Signals = True,
    keep: Keep = None,
    allow_mixed: AllowMixed = False,
    quiet: Quiet = False,
) -> None:
    """Join the shares that --shard ran into one study."""
    done = merge_runs(
        out,
        folders or (),
        records=None if records is None else str(records),
        signals=signals,
        keep=keep or (),
        allow_mixed=allow_mixed,
        reporter=reporter_for(quiet),
    )
    _show(done, quiet)


def summary(folder: Folder) -> None:
    """Show the summary of a finished study."""
    _show(open_study(folder), quiet=False)


def _share(text: str | None) -> tuple[int, int] | None:
    if text is None:
        return None
    match = re.fullmatch(r"(\d+)/(\d+)", text)
    if not match or not 1 <= int(match[1]) <= int(match[2]):
        raise argument_error("shard", "be I/N with 1 <= I <= N, such as 3/16", repr(text))
    return int(match[1]), int(match[2])


def _show(done: Study, quiet: bool, max_failed: int | None = None) -> None:
    if not quiet:
        found = done.summary()
        console.print(f"[bold]{escape(found.heading)}", highlight=False, soft_wrap=True)
        for table in found.tables:
            console.print(table)
        console.print(f"Results are in {escape(str(done.folder))}: study.nc, study.csv, summary.md",
                      highlight=False, soft_wrap=True)  # fmt: skip
    if max_failed is not None and done.failed > max_failed:
        error_console.print(
            f"{counted(done.failed, 'run')} diverged, more than --max-failed {max_failed} allows.",
            highlight=False, soft_wrap=True,
        )  # fmt: skip
        raise typer.Exit(1)
