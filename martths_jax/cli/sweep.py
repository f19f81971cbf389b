"""``martths sweep``: a study repeated on a grid of design parameters."""

from __future__ import annotations

from rich.markup import escape

from martths_jax.campaign.provenance import command_line
from martths_jax.cli.console import console
from martths_jax.cli.options import DRAWN, STUDY, option, takes
from martths_jax.cli.run_options import (
    AllowMixed,
    Config,
    Figures,
    Fresh,
    Quiet,
    kept,
    reporter_for,
    set_devices,
    settings_of,
    shown_indices,
)
from martths_jax.sweep import make_sweep, run_sweep
from martths_jax.sweep.axes import split_axis
from martths_jax.sweep.config import DEFAULTS, SHOWN

#: A longer table than this is not printed; it is in the folder.
MOST_ROWS = 60


def _axis(name: str, what: str):
    return option(str | None, name, metavar="VALUES", help=f"Axis: {what}")


@takes((*STUDY, *DRAWN, "memory_gb"), DEFAULTS)
def sweep(
    nb: _axis("--nb", "buffer length Nb, as 128,256,512") = None,
    no: _axis("--no", "overlap No in samples") = None,
    no_fraction: _axis("--no-fraction", "overlap as a share of Nb; 1 is every sample") = None,
    hop: _axis("--hop", "Nb - No in samples, instead of No") = None,
    fb: _axis("--fb", "update rate in Hz, instead of No") = None,
    axis: option(
        list[str] | None,
        "--axis",
        metavar="NAME=VALUES",
        callback=None,  # the commas are between the values
        help="Any axis: pull=1e-8:1e-4:log9, scale=0.1:1:lin5, q=1e-6,1e-5; also noise_power, "
        "fs, alpha, p, spread; may be repeated",
    ) = None,
    config: Config = None,
    settings: dict | None = None,
    index: shown_indices(SHOWN) = None,
    fresh: Fresh = False,
    figures: Figures = True,
    allow_mixed: AllowMixed = False,
    quiet: Quiet = False,
) -> None:
    """Repeat a study on a grid of parameters, the same plants and noise in every cell."""
    flags = {"nb": nb, "no": no, "no_fraction": no_fraction, "hop": hop, "fb": fb}
    axes = [(k, v) for k, v in flags.items() if v is not None]
    axes += [split_axis(text) for text in axis or ()]
    chosen = make_sweep(axes, settings_of(config, settings), shown=index or SHOWN)
    set_devices(chosen.study.devices)
    with kept(chosen.study.out):
        done = run_sweep(
            chosen, reporter=reporter_for(quiet), fresh=fresh, figures=figures,
            allow_mixed=allow_mixed, command_line=command_line(),
        )  # fmt: skip
    if quiet:
        return
    found = done.summary(chosen.shown)
    console.print(f"[bold]{escape(found.heading)}", highlight=False, soft_wrap=True)
    for table in found.tables:
        if len(table.rows) <= MOST_ROWS:
            console.print(table)
    console.print(
        f"Results are in {escape(str(done.folder))}: sweep.nc, sweep.csv, summary.md"
        f"{', figures' if figures else ''}", highlight=False, soft_wrap=True,
    )  # fmt: skip
