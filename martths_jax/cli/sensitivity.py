"""``martths sensitivity``: Sobol' indices against plant, noise and motion."""

from __future__ import annotations

from rich.markup import escape

from martths_jax.campaign.provenance import command_line
from martths_jax.cli.console import console
from martths_jax.cli.options import STUDY, takes
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
from martths_jax.sensitivity import run_sensitivity
from martths_jax.sensitivity.results import leading
from martths_jax.sensitivity.runner import DEFAULTS
from martths_jax.sweep.config import SHOWN


@takes(
    (*STUDY, "memory_gb"),
    DEFAULTS | {"trials": f"{DEFAULTS['trials']} base samples N, a power of two; N (d + 2) runs"},
)
def sensitivity(
    config: Config = None,
    settings: dict | None = None,
    index: shown_indices(SHOWN) = None,
    fresh: Fresh = False,
    figures: Figures = True,
    allow_mixed: AllowMixed = False,
    quiet: Quiet = False,
) -> None:
    """What drives each index: Sobol' indices of plant parameters, noise and motion."""
    asked = settings_of(config, settings)
    set_devices(asked.get("devices"))
    with kept(asked.get("out", DEFAULTS["out"])):
        done = run_sensitivity(
            asked,
            shown=index or SHOWN,
            reporter=reporter_for(quiet),
            fresh=fresh,
            figures=figures,
            allow_mixed=allow_mixed,
            command_line=command_line(),
        )
    if quiet:
        return
    console.print(f"[bold]{escape(done.summary().heading)}", highlight=False, soft_wrap=True)
    for controller in done.dataset.controller.values:
        console.print(leading(done, str(controller)))
    console.print(
        f"Results are in {escape(str(done.folder))}: sensitivity.nc, sensitivity.csv, summary.md"
        f"{', figures' if figures else ''}", highlight=False, soft_wrap=True,
    )  # fmt: skip
