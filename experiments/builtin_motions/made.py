"""Write the facts of the built-in motions as made, against which kept copies are checked.

MARTHS_CACHE=off python experiments/builtin_motions/made.py
"""

from __future__ import annotations

import json

from martths_jax.motions import BUILTIN_NAMES, load_record
from martths_jax.motions.builtin.store import MADE_FILE, made_facts


def main() -> None:
    made = {}
    for name in BUILTIN_NAMES:
        record = load_record(name)
        facts = made_facts(record.acceleration, record.dt)
        made[name] = {key: float(f"{value:.8g}") for key, value in facts.items()}
    MADE_FILE.write_text(json.dumps(made, indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
