"""Turn results/*.csv into the Markdown tables of the README.

python experiments/guarded_adfc/tables.py [candidates|seeds|conditions]
"""

from __future__ import annotations

import csv
import sys
from pathlib import Path

HERE = Path(__file__).parent
MEDIANS = ("J1_1", "J2_1", "J2_2", "J3_1", "J3_2", "J5_4", "J5_28", "J6_4", "J6_28")
PEAKS = ("J3_1", "J3_2", "J6_4", "J6_28")


def table(name: str) -> str:
    """Rows of a run's motions joined: lost trials added up, the worst motion's percentiles."""
    runs: dict[str, list[dict]] = {}
    with (HERE / "results" / f"{name}.csv").open(newline="") as file:
        for row in csv.DictReader(file):
            key = row["run"] if name != "seeds" else f"seed {row['seed']}"
            runs.setdefault(key, []).append(row)
    lines = [
        f"| {name[:-1]} | lost | saturated | median " + ", ".join(MEDIANS) + " | 99th percentile "
        + ", ".join(PEAKS) + " | largest " + ", ".join(PEAKS) + " |",
        "|---|---|---|---|---|---|",
    ]  # fmt: skip
    for key, rows in runs.items():
        total = sum(int(r["trials"]) for r in rows)
        mean = [sum(float(r[f"median_{n}"]) for r in rows) / len(rows) for n in MEDIANS]
        worst = [
            [max(float(r[f"{kind}_{n}"]) for r in rows) for n in PEAKS] for kind in ("p99", "max")
        ]
        lines.append(
            f"| {key} | {sum(int(r['lost']) for r in rows)} of {total} "
            f"| {sum(int(r['saturated']) for r in rows)} | "
            + " | ".join(" ".join(f"{x:.2f}" for x in group) for group in (mean, *worst))
            + " |"
        )
    return "\n".join(lines)


if __name__ == "__main__":
    print(
        "\n\n".join(table(name) for name in sys.argv[1:] or ("candidates", "seeds", "conditions"))
    )
