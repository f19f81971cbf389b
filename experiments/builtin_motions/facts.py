"""Measure the facts of the real records and write the package's data file.

    python experiments/builtin_motions/facts.py --records DIR

Seeds already in the data file are kept; `seeds.py` chooses them.
"""

from __future__ import annotations

import argparse
import json

from martths_jax.motions import load_record
from martths_jax.motions.builtin.facts import FACTS_FILE, measure, to_plain

RECORDS = ("elcentro", "kobe", "morganhill")
ABOUT = (
    "Facts measured on the unscaled records of the v-maRTHS benchmark by "
    "experiments/builtin_motions/facts.py; martths_jax/motions/builtin/facts.py says what each is."
)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--records", help="folder of the benchmark's .mat files")
    folder = parser.parse_args().records
    seeds = dict.fromkeys(RECORDS, 1)
    if FACTS_FILE.exists():
        seeds = json.loads(FACTS_FILE.read_text(encoding="utf-8"))["seeds"]
    write(seeds, {name: to_plain(measure(load_record(name, records=folder))) for name in RECORDS})


def write(seeds: dict, records: dict) -> None:
    """Write the data file, one fact a line."""
    lines = [f'  "about": {json.dumps(ABOUT)}', f'  "seeds": {json.dumps(seeds)}']
    blocks = []
    for name, facts in records.items():
        inner = ",\n".join(f"      {json.dumps(k)}: {json.dumps(v)}" for k, v in facts.items())
        blocks.append(f'    "{name}": {{\n{inner}\n    }}')
    lines.append('  "records": {\n' + ",\n".join(blocks) + "\n  }")
    FACTS_FILE.write_text("{\n" + ",\n".join(lines) + "\n}\n", encoding="utf-8")


if __name__ == "__main__":
    main()
