"""Whether two states of the package give the same numbers: for changes that should change none.

    git worktree add ../before COMMIT
    python benchmarks/same_numbers.py ../before .      # two checkouts
    python benchmarks/same_numbers.py ../before        # that one and this

Each checkout runs a small study in a process of its own: two controllers, two motions, 40 plants,
one of which LQG loses.  `study.nc`, `study.csv` and `summary.md` must agree to the bit but for what
says which code and machine they come from.  Exit code 1 if they do not.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
TRIALS = 40
#: A plant that LQG loses: its frame's pair of zeros stands 30 deviations away from the nominal one.
FAR, PAIR, DEVIATIONS = 17, 4, 30.0
#: Attributes of study.nc that say where the numbers come from.
ORIGIN = ("version_", "git_commit", "identity", "configuration", "provenance", "martths_content",
          "platform", "machines", "content", "controllers")  # fmt: skip


def write_plants(path: Path) -> None:
    """Standard normal draws of the plants, one of them far off."""
    draws = np.random.default_rng(15).standard_normal((TRIALS, 9))
    draws[FAR - 1, PAIR] = DEVIATIONS
    heads = subprocess.run(
        [sys.executable, "-c", "from martths_jax.plant import PARAMETERS as p; print(','.join(p))"],
        capture_output=True, text=True, check=True, cwd=HERE.parent,
    ).stdout.strip()  # fmt: skip
    rows = [",".join(map(repr, row)) for row in draws.tolist()]
    path.write_text("\n".join([heads, *rows]) + "\n", encoding="utf-8")


def run(checkout: Path, plants: Path, out: Path) -> None:
    """The study with a checkout's package."""
    code = "from martths_jax.cli import main; main()"
    command = [
        sys.executable, "-c", code, "study", "--plants", str(plants), "--plants-as", "draws",
        "--motion", "elcentro-like", "--motion", "kobe-like", "--controller", "lqg",
        "--controller", "adfc", "--no-signals", "--out", str(out), "--quiet",
    ]  # fmt: skip
    # The working directory comes first on the path of `python -c`.
    subprocess.run(command, check=True, cwd=checkout, env=os.environ | {"PYTHONPATH": ""})


def differences(one: Path, other: Path) -> list[str]:
    """Sentences about everything that is not the same in two studies' folders."""
    import xarray as xr

    found = []
    for name in ("study.csv", "summary.md"):
        if (one / name).read_bytes() != (other / name).read_bytes():
            found.append(f"{name} differs")
    a, b = (xr.load_dataset(folder / "study.nc", engine="h5netcdf") for folder in (one, other))
    for name in sorted({*a.variables} ^ {*b.variables}):
        found.append(f"study.nc: only one has {name}")
    for name in sorted({*a.variables} & {*b.variables}):
        x, y = a[name].values, b[name].values
        x, y = (v.astype(str) if v.dtype == object else v for v in (x, y))
        if x.shape != y.shape or x.dtype != y.dtype or x.tobytes() != y.tobytes():
            found.append(f"study.nc: {name} differs")
    for key in sorted({*a.attrs} | {*b.attrs}):
        same = str(a.attrs.get(key)) == str(b.attrs.get(key))
        if not same and not key.startswith(ORIGIN) and "sha256" not in key:
            found.append(f"study.nc: attribute {key} differs")
    return found


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("before", type=Path, help="checkout of the state before")
    parser.add_argument("after", type=Path, nargs="?", default=HERE.parent, help="[this one]")
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as place:
        folders = [Path(place) / name for name in ("before", "after")]
        write_plants(Path(place) / "plants.csv")
        for checkout, folder in zip((asked.before, asked.after), folders, strict=True):
            run(checkout.resolve(), Path(place) / "plants.csv", folder)
        text = (folders[0] / "study.csv").read_text("utf-8")
        lost = sum(",diverged," in line or ",nonfinite," in line for line in text.splitlines())
        print(f"{len(text.splitlines()) - 1} runs, {lost} of them lost")
        found = differences(*folders)
        if not lost:
            found.append("no run was lost, so that part was not compared")
    print("\n".join(found) if found else "study.nc, study.csv and summary.md are the same")
    return bool(found)


if __name__ == "__main__":
    sys.exit(main())
