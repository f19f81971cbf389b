"""Medians and interquartile ranges of a study beside what the paper states, as Markdown.

    python experiments/study_1000/compare.py STUDY_FOLDER experiments/study_1000/results

The statements are those of Calayir, Tao & Mercan 2025 on their Monte Carlo study.
"""

from __future__ import annotations

import json
import shutil
import sys
from pathlib import Path

import numpy as np

from martths_jax.indices import NAMES
from martths_jax.study import open_study
from martths_jax.study.summary import Table, number
from martths_jax.watch import Status

LOCAL = [n for n in NAMES if n.split("_")[0] in ("J1", "J2", "J3", "J4", "J5", "J6")]
GLOBAL = [n for n in NAMES if n.split("_")[0] in ("J8", "J10")]


def spread(dataset, controller: str, motion: str, name: str) -> tuple[float, float, float]:
    """Quartiles of an index over the uncertain trials that finished."""
    cell = dataset.value.sel(controller=controller, motion=motion, index=name).values[1:]
    return tuple(np.nanpercentile(cell, [25, 50, 75]))


def quartiles(dataset, motion: str) -> Table:
    """Median and interquartile range of every index, LQG beside ADFC."""
    rows = []
    for name in NAMES:
        cells = []
        for controller in ("lqg", "adfc"):
            low, middle, high = spread(dataset, controller, motion, name)
            cells += [number(middle), f"{number(low)} – {number(high)}", number(high - low)]
        rows.append((name, *cells))
    heads = ("index", "LQG median", "quartiles", "IQR", "ADFC median", "quartiles", "IQR")
    return Table(f"Medians and interquartile ranges on {motion}", heads, rows)


def statements(dataset) -> Table:
    """What the paper says, and what came out."""
    first = str(dataset.motion.values[0])
    median = lambda c, n, m=first: spread(dataset, c, m, n)[1]  # noqa: E731
    iqr = lambda c, n, m=first: np.subtract(*spread(dataset, c, m, n)[::-2])  # noqa: E731
    rows = []

    def add(claim: str, holds: bool, found: str) -> None:
        rows.append((claim, "yes" if holds else "**no**", found))

    for group, limit, unit in (("J1", 1.0, "ms"), ("J2", 5.0, "%"), ("J3", 5.0, "%")):
        found = [median("adfc", f"{group}_{i}") for i in (1, 2)]
        add(f"ADFC median {group} below {limit:g} {unit} for both actuators ({first})",
            max(map(abs, found)) < limit, ", ".join(map(number, found)))  # fmt: skip
    better = [n for n in LOCAL if abs(median("adfc", n)) < abs(median("lqg", n))]
    worse = [n for n in LOCAL if n not in better]
    exceptions = f"; not {', '.join(worse)}" if worse else ""
    add(f"ADFC medians better than LQG's in J1 ... J6 ({first})", not worse,
        f"{len(better)} of {len(LOCAL)}{exceptions}")  # fmt: skip
    wider = [n for n in LOCAL if iqr("adfc", n) > iqr("lqg", n)]
    add(f"and its interquartile ranges narrower ({first})", not wider,
        f"{len(LOCAL) - len(wider)} of {len(LOCAL)}"
        + (f"; wider in {', '.join(wider)}" if wider else ""))  # fmt: skip
    larger = [n for n in GLOBAL if median("adfc", n) > median("lqg", n)]
    add(f"ADFC slightly worse than LQG in J8 and J10 ({first})", len(larger) == len(GLOBAL),
        f"in {len(larger)} of {len(GLOBAL)}")  # fmt: skip
    ranked = sorted(NAMES[2:], key=lambda n: -iqr("adfc", n))
    add("J9_4 and the global indices spread most (ADFC)", ranked[0] in ["J9_4", *GLOBAL],
        "widest: " + ", ".join(f"{n} {number(iqr('adfc', n))}" for n in ranked[:5]))  # fmt: skip
    for controller in ("lqg", "adfc"):
        mean = {
            str(m): np.mean([median(controller, n, m) for n in ("J2_1", "J2_2", "J3_1", "J3_2")])
            for m in dataset.motion.values
        }
        add(f"Morgan Hill gives the largest errors (median J2, J3; {controller})",
            max(mean, key=mean.get).startswith("morgan"),
            ", ".join(f"{m} {number(v)} %" for m, v in mean.items()))  # fmt: skip
    lost = int(np.sum(dataset.status.values >= Status.DIVERGED))
    add("No trial diverged", lost == 0, f"{lost} of {dataset.status.size} runs")
    return Table("What the paper states", ("statement", "holds", "here"), rows)


def main(folder: Path, out: Path) -> None:
    """Write the comparison and copy the small files of the study."""
    study = open_study(folder)
    out.mkdir(parents=True, exist_ok=True)
    tables = [statements(study.dataset)]
    tables += [quartiles(study.dataset, str(m)) for m in study.dataset.motion.values]
    text = "# Study beside the paper's statements\n\n" + "\n".join(t.markdown() for t in tables)
    (out / "comparison.md").write_text(text, encoding="utf-8")
    shutil.copyfile(folder / "summary.md", out / "summary.md")
    keys = ("version_martths_jax", "version_jax", "version_numpy", "version_scipy", "git_commit",
            "platform", "command_line", "seed", "trials", "configuration",
            "record_sha256")  # fmt: skip
    about = {k: str(study.dataset.attrs[k]) for k in keys}
    sessions = json.loads((folder / "provenance.json").read_text("utf-8"))["sessions"]
    for session in sessions:
        session.pop("host", None)
        session.pop("command_line", None)
    about["sessions"] = sessions
    (out / "provenance.json").write_text(json.dumps(about, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
