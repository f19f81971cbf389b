"""Shares of a study, run apart, become one."""

from __future__ import annotations

import json
import shutil
from collections.abc import Sequence
from pathlib import Path

from martths_jax.campaign import provenance
from martths_jax.campaign.config import make_config
from martths_jax.campaign.files import write_text, writing
from martths_jax.campaign.machine import MIXED_NOTE
from martths_jax.campaign.plan import build_plan
from martths_jax.campaign.progress import Reporter
from martths_jax.campaign.session import read_provenance
from martths_jax.campaign.store import PLANTS, RunFolder
from martths_jax.errors import InputError, raise_all
from martths_jax.guests import FILES, kept
from martths_jax.study.results import Study
from martths_jax.study.runner import MonteCarlo, finish


def merge_runs(
    out: str | Path,
    folders: Sequence[str | Path] = (),
    *,
    records: str | None = None,
    signals: bool = True,
    keep: Sequence[int] = (),
    allow_mixed: bool = False,
    reporter: Reporter | None = None,
) -> Study:
    """Join the shares of a study and write its results.

    Args:
        out: folder of the whole; may hold shares itself, or be the only one.
        folders: further folders with shares of the same study.
        records: where the ground motions are here, for the signals.
        signals: run the chosen trials again for their signals.
        keep: further trials whose signals are stored.
        allow_mixed: join shares of machines that compile in another way.
        reporter: is told what happens.

    Raises:
        InputError: the shares are of different studies, or trials are missing; what is in `out`
            stays there.
    """
    out, reporter = Path(out), reporter or Reporter()
    shares = [RunFolder.open(Path(folder)) for folder in folders]
    first = shares[0] if shares else RunFolder.open(out)
    problems = []
    for share in shares:
        found = provenance.differences(first.header["identity"], share.header["identity"])
        if share.trials != first.trials:
            found.append(f"trials: {first.trials!r} in {first.path}, {share.trials!r} there")
        problems += [f"{share.path} holds another study: {text}." for text in found]
    raise_all(problems, "The folders cannot be merged")
    machines = {k: v for share in (first, *shares) for k, v in share.header["machines"].items()}
    if len(machines) > 1 and not allow_mixed:
        raise InputError(_mixed(machines))
    head = first.header | {"machines": machines}
    said: list[str] = []

    def notice(text: str) -> None:
        said.append(text)
        reporter.notice(text)

    with RunFolder.start(out, head, allow_mixed=allow_mixed, notice=notice) as run:
        for share in shares:
            if share.path.resolve() != out.resolve():
                _copy(share, run, reporter)
        raise_all(run.missing(), f"{out} is not complete")
        engine = engine_again(run, records, keep, reporter) if signals else None
        if len(machines) > 1 and not any(MIXED_NOTE in text for text in said):
            mixed = f"Results of {len(machines)} kinds of machines are mixed."
            reporter.notice(f"{mixed}  {MIXED_NOTE}")
        return finish(run, engine, reporter)


def _mixed(machines: dict) -> str:
    one, other = list(machines.values())[:2]
    return (
        "The shares were computed on machines that compile in another way, so their last bits are "
        f"of two kinds: {'; '.join(provenance.differences(one, other, 'machine.'))}.  Merge them "
        f"all the same with --allow-mixed (`allow_mixed=True`).  {MIXED_NOTE}"
    )


def _copy(share: RunFolder, run: RunFolder, reporter: Reporter) -> None:
    for controller, motion in share.cells:
        share.done(controller, motion, reporter.notice)  # sets aside what is damaged
        for _, _, path in share.parts(controller, motion):
            target = run.folder(controller, motion) / path.name
            if not target.exists():
                with writing(target) as temporary:
                    shutil.copyfile(path, temporary)
    run.keep_draws(share.draws())
    if (share.path / FILES).is_dir():
        shutil.copytree(share.path / FILES, run.path / FILES, dirs_exist_ok=True)
    sessions = read_provenance(run.path)["sessions"]
    sessions += [s for s in read_provenance(share.path)["sessions"] if s not in sessions]
    write_text(run.path / "provenance.json", json.dumps({"sessions": sessions}, indent=1))


def engine_again(run: RunFolder, records: str | None, keep, reporter: Reporter):
    """Engine that runs chosen trials again; None, and a notice, where that cannot be done."""
    settings = run.header["config"] | {"out": str(run.path), "keep": tuple(keep)}
    if records is not None:
        settings["records"] = records
    settings["controller"] = {
        name: table | {"kind": kept(table.get("kind", name), run.path)}
        for name, table in settings["controller"].items()
    }
    settings["problem"] = kept(settings["problem"], run.path)
    settings["indices"] = tuple(kept(text, run.path) for text in settings["indices"])
    for table in settings["controller"].values():
        if table["kind"].startswith(str(run.path)):
            reporter.notice(f"Loading runs the code of {table['kind'].rpartition('.py')[0]}.py.")
    if (run.path / PLANTS).exists():
        settings |= {"plants": str(run.path / PLANTS), "plants_as": "auto", "draws": "independent"}
    try:
        plan = build_plan(make_config(settings))
        asked = json.loads(json.dumps(provenance.identity(plan)))
        given = run.header["identity"]
        skip = {"draws"}  # a stored table of plants stands in for the way it was made
        raise_all(provenance.differences(*({k: v for k, v in d.items() if k not in skip}
                                           for d in (given, asked))))  # fmt: skip
        return MonteCarlo(plan).make_engine(reporter)
    except InputError as error:
        reporter.notice(f"No signals are stored, since the study cannot be run again here: {error}")
        return None
