"""``martths study``, ``init-config``, ``merge``, ``summary`` and ``export``."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated

import typer
from rich.markup import escape

from martths_jax.campaign.config import make_config, read_toml
from martths_jax.campaign.distributed import JOIN_TIMEOUT, LOST_TIMEOUT, join
from martths_jax.campaign.export import export_plants, study_signals, write_csv, write_mat
from martths_jax.campaign.provenance import command_line
from martths_jax.campaign.template import write_template
from martths_jax.cli.console import console, error_console
from martths_jax.cli.motion_options import (
    Dt,
    Motions,
    Pga,
    Records,
    Resample,
    Sa,
    Scale,
    Units,
    Variable,
)
from martths_jax.cli.run_options import (
    AllowMixed,
    Devices,
    Indices,
    Quiet,
    reporter_for,
    say_what_is_kept,
    set_devices,
    words,
)
from martths_jax.errors import InputError, argument_error
from martths_jax.study import Study, merge_runs, open_study, run_study
from martths_jax.text import counted

Folder = Annotated[Path, typer.Argument(help="Folder of a study.")]
Keep = Annotated[
    str | None,
    typer.Option("--keep", metavar="1,617", help="Trials whose signals are stored too."),
]


def study(
    config: Annotated[
        Path | None, typer.Option("--config", help="TOML file, see init-config; flags override it.")
    ] = None,
    trials: Annotated[int | None, typer.Option("--trials", help="Uncertain plants [1000].")] = None,
    seed: Annotated[int | None, typer.Option("--seed", help="Seed of all draws [1].")] = None,
    controllers: Annotated[
        list[str] | None,
        typer.Option(
            "--controller",
            metavar="[NAME=]KIND[{KEY=VALUE,...}]",
            help="lqg, adfc or passthrough, also as 'slow=adfc{nb=2048,no=2047}'; repeated or with "
            "commas [lqg, adfc].",
        ),
    ] = None,
    indices: Indices = None,
    motions: Motions = None,
    records: Records = None,
    scale: Scale = None,
    pga: Pga = None,
    sa: Sa = None,
    units: Units = None,
    dt: Dt = None,
    variable: Variable = None,
    resample: Resample = None,
    draws: Annotated[
        str | None, typer.Option("--draws", help="independent, lhs or sobol [independent].")
    ] = None,
    plants: Annotated[
        Path | None, typer.Option("--plants", help="CSV with the nine parameters of each plant.")
    ] = None,
    plants_as: Annotated[
        str | None, typer.Option("--plants-as", help="What its numbers are: hz, rad/s or draws.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", help="Folder of the results [study].")
    ] = None,
    fresh: Annotated[
        bool, typer.Option("--fresh", help="Start over: delete the study in the folder.")
    ] = False,
    keep: Keep = None,
    signals: Annotated[
        bool | None, typer.Option("--signals/--no-signals", help="Store chosen trials' signals.")
    ] = None,
    devices: Devices = None,
    memory_gb: Annotated[
        float | None, typer.Option("--memory", help="Bound on a chunk's memory [GB].")
    ] = None,
    max_failed: Annotated[
        int | None, typer.Option("--max-failed", help="More diverged runs than this: exit code 1.")
    ] = None,
    shard: Annotated[
        str | None,
        typer.Option("--shard", metavar="I/N", help="Run the I-th of N shares; merge them after."),
    ] = None,
    distributed: Annotated[
        bool, typer.Option("--distributed", help="Join the cluster's other processes of this job.")
    ] = False,
    coordinator: Annotated[
        str | None, typer.Option("--coordinator", help="host:port of process 0.")
    ] = None,
    num_processes: Annotated[
        int | None, typer.Option("--num-processes", help="How many processes there are.")
    ] = None,
    process_id: Annotated[
        int | None, typer.Option("--process-id", help="Which of them this is, from 0.")
    ] = None,
    join_timeout: Annotated[
        float, typer.Option("--join-timeout", help="Longest wait for the other processes [s].")
    ] = JOIN_TIMEOUT,
    lost_timeout: Annotated[
        float, typer.Option("--lost-timeout", help="A machine silent for longer is lost [s].")
    ] = LOST_TIMEOUT,
    allow_mixed: AllowMixed = False,
    quiet: Quiet = False,
) -> None:
    """Run controllers x motions x uncertain plants; resumes and extends what is in the folder."""
    given = {
        "trials": trials, "seed": seed, "controllers": words(controllers),
        "indices": words(indices), "motions": motions or None, "records": records,
        "scale": scale, "pga": pga, "sa": sa, "units": units, "dt": dt, "variable": variable,
        "resample": resample, "draws": draws, "plants": plants, "plants_as": plants_as,
        "out": out, "keep": trial_list(keep), "signals": signals, "devices": devices,
        "memory_gb": memory_gb, "max_failed": max_failed,
    }  # fmt: skip
    settings = {} if config is None else read_toml(config)
    chosen = make_config(settings | {k: v for k, v in given.items() if v is not None})
    if chosen.devices is not None:
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
    try:
        done = run_study(
            chosen,
            reporter=reporter_for(quiet),
            fresh=fresh,
            share=share,
            together=together,
            allow_mixed=allow_mixed,
            command_line=command_line(),
        )
    except KeyboardInterrupt:
        say_what_is_kept(chosen.out)
        raise
    if done is not None:
        _show(done, quiet, chosen.max_failed)
    elif together is None and not quiet:
        console.print(
            f"Share {shard} is done; when all are: martths merge {escape(chosen.out)}",
            highlight=False, soft_wrap=True,
        )  # fmt: skip


def init_config(
    path: Annotated[Path, typer.Argument(help="File to write.")] = Path("study.toml"),
    force: Annotated[bool, typer.Option("--force", help="Overwrite the file.")] = False,
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
    signals: Annotated[bool, typer.Option("--signals/--no-signals")] = True,
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
        keep=trial_list(keep) or (),
        allow_mixed=allow_mixed,
        reporter=reporter_for(quiet),
    )
    _show(done, quiet)


def summary(folder: Folder) -> None:
    """Show the summary of a finished study."""
    _show(open_study(folder), quiet=False)


def export(
    folder: Folder,
    mat: Annotated[Path | None, typer.Option("--mat", help="MATLAB file to write.")] = None,
    csv: Annotated[Path | None, typer.Option("--csv", help="Tidy CSV file to write.")] = None,
    plants: Annotated[
        Path | None, typer.Option("--plants", help="CSV file for the plants' parameters.")
    ] = None,
    signals: Annotated[
        bool,
        typer.Option("--signals/--no-signals", help="Stored signals go into the MATLAB file."),
    ] = True,
) -> None:
    """Write a finished study's results, signals or plants for other tools."""
    if not any((mat, csv, plants)):
        raise InputError("Say what to export: --mat FILE, --csv FILE or --plants FILE.")
    done = open_study(folder)
    stored = signals and (folder / "signals.nc").is_file()
    if mat is not None:
        write_mat(done.dataset, mat, study_signals(done) if stored else ())
    if csv is not None:
        write_csv(done.dataset, csv)
    if plants is not None:
        export_plants(done.dataset, plants)
    for path in filter(None, (mat, csv, plants)):
        console.print(f"Wrote {escape(str(path))}", highlight=False, soft_wrap=True)


def trial_list(text: str | None) -> list[int] | None:
    """Trial numbers of ``--keep 1,617``.

    Raises:
        InputError: if it is not such a list.
    """
    if text is None:
        return None
    if not re.fullmatch(r"\s*\d+\s*(,\s*\d+\s*)*", text):
        raise argument_error("keep", "be trial numbers such as 1,617", repr(text))
    return [int(word) for word in text.split(",")]


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
