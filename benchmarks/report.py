"""Tables of the comparison as Markdown and CSV."""

from __future__ import annotations

import csv
import os
import platform
import shutil
import subprocess
import sys
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

TITLES = {
    "trials": "Time against trials",
    "length": "Time against length",
    "nb": "Time against the buffer length N_b",
    "controller": "ADFC and LQG",
    "devices": "Time against devices",
}


def describe_machine() -> dict[str, str]:
    """What the numbers depend on."""
    model = platform.processor() or platform.machine()
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        model = next(x.split(":")[1].strip() for x in lines if x.startswith("model name"))
    except (OSError, StopIteration):
        pass
    versions = [f"Python {platform.python_version()}"]
    for name in ("martths_jax", "jax", "numpy", "numba"):
        try:
            versions.append(f"{name} {version(name)}")
        except PackageNotFoundError:
            continue
    if shutil.which("gcc"):
        told = subprocess.run(["gcc", "-dumpfullversion"], capture_output=True, text=True)
        versions.append(f"gcc {told.stdout.strip()}")
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    command = "python benchmarks/compare.py " + " ".join(
        # A folder's name says nothing about the measurement.
        "DIR" if os.path.isdir(x) else x
        for x in sys.argv[1:]
    )
    return {
        "command": command.strip(),
        "machine": f"{model}, {cores} cores, {platform.system()}",
        "versions": ", ".join(versions),
    }


def number(x) -> str:
    """A cell."""
    if x is None:
        return "-"
    if isinstance(x, bool):
        return "yes" if x else "NO"
    if isinstance(x, float):
        return f"{x:.0f}" if abs(x) >= 1000 else f"{x:.3g}"
    return str(x)


def markdown(rows: list[dict], columns: dict[str, str]) -> str:
    """A table with the given columns, key: heading; the first is left-aligned."""
    lines = ["| " + " | ".join(columns.values()) + " |"]
    lines.append("|---|" + "---:|" * (len(columns) - 1))
    for row in rows:
        lines.append("| " + " | ".join(number(row[key]) for key in columns) + " |")
    return "\n".join(lines)


def peers_text(rows: list[dict]) -> str:
    return markdown(
        rows,
        {
            "program": "program",
            "trials": "trials",
            "samples": "samples",
            "seconds": "time [s]",
            "trial_samples_per_s": "trial-samples/s",
            "engine_is_faster_by": "this engine is faster by",
            "ready_is_faster_by": "with its noise ready",
            "compile_s": "compile [s]",
            "peak_MiB": "peak memory [MiB]",
            "median_difference": "index difference, median",
            "worst_difference": "worst",
            "delays_that_differ": "delays that differ",
        },
    )


def cost_text(rows: list[dict]) -> str:
    """One table for each thing varied; the last column compares rates within it."""
    parts = []
    for name, title in TITLES.items():
        group = [row for row in rows if row["table"] == name]
        if not group:
            continue
        # Trials: per 1000, the study; devices: one; otherwise the last row.
        base = next((r for r in group if (name, r["value"]) in {("trials", 1000), ("devices", 1)}),
                    group[-1])  # fmt: skip
        for row in group:
            if row["relative"] is None:  # not compared within a turn
                row["relative"] = row["trial_samples_per_s"] / base["trial_samples_per_s"]
        columns = {
            "value": name,
            "trials": "trials in all",
            "samples": "samples",
            "devices": "devices used at most",
            "seconds": "time [s]",
            "trial_samples_per_s": "trial-samples/s",
            "relative": f"rate to that at {base['value']}",
            "runs": "runs",
        }
        parts.append(f"### {title}\n\n{markdown(group, columns)}")
    return "\n\n".join(parts)


def write_tables(found: dict[str, list[dict]], about: dict[str, str], out: Path | None) -> None:
    """Print the tables; write NAME.md and NAME.csv into the folder if there is one."""
    heads = {"peers": "Programs of the same job", "cost": "What time grows with"}
    texts = {"peers": peers_text, "cost": cost_text}
    about_text = "\n".join(f"- {key}: {value}" for key, value in about.items())
    for name, rows in found.items():
        text = f"## {heads[name]}\n\n{about_text}\n\n{texts[name](rows)}\n"
        print(text)
        if out is None or not rows:
            continue
        out.mkdir(parents=True, exist_ok=True)
        (out / f"{name}.md").write_text(text, encoding="utf-8")
        with open(out / f"{name}.csv", "w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, list(rows[0]))
            writer.writeheader()
            writer.writerows(rows)
