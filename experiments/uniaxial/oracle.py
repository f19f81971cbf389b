"""The printed table of the uniaxial RTHS benchmark (Silva et al. 2020), from a plain NumPy loop.

    python experiments/uniaxial/oracle.py --records DIR [--choices] [--out DIR]

DIR holds ElCentroAccelNoScaling.mat, KobeAccelNoScaling.mat and MorganAccelNoScaling.mat.  Writes
table.csv (indices by record, case, noise seed and definition) and stability.csv; with --choices
also choices.csv, what each choice that the text leaves open moves: ten minutes instead of two.
"""

from __future__ import annotations

import argparse
import csv
from dataclasses import replace
from pathlib import Path

import numpy as np
from critical_delay import critical_delays, critical_samples, reserve
from scipy.io import loadmat
from uniaxial_indices import NAMES, script, text
from uniaxial_loop import CASES, DT, FS, TEXT, Loop, Rules, reference_response, simulate

SCALE, RECORDS, SEEDS = 0.40, ("ElCentro", "Kobe", "Morgan"), (None, *range(1, 9))
PRINTED = {
    1: (4.6, 10.4, 11.5, 36.1, 19.0, 32.3, 32.4, 14.8, 14.8),
    2: (4.6, 9.8, 11.1, 33.1, 17.1, 30.5, 30.5, 15.3, 15.2),
    3: (4.6, 9.1, 10.2, 49.9, 36.7, 49.8, 49.8, 35.5, 35.6),
    4: (4.6, 10.5, 11.3, 72.6, 35.2, 68.5, 68.7, 33.4, 33.3),
}
DEFINITIONS = {"script": script, "text": text}
CONTROLLERS = {
    "PI + lead": {},
    "PI": {"lead": "none"},
    "lead": {"pi": False},
    "passthrough": {"lead": "none", "pi": False},
}
CHOICES = {
    "as chosen": {},
    "delay on the force": {"target_delay": 0, "force_delay": 1},
    "no delay": {"target_delay": 0},
    "no delay, force felt at once": {"target_delay": 0, "force": "coupled"},
    "two samples of delay": {"target_delay": 1, "force_delay": 1},
    "constants of the text": {"constants": TEXT},
    "constants of the text, no delay": {"constants": TEXT, "target_delay": 0},
    "gain at the measurement": {"gain_at": "measurement"},
    "damping not moved": {"moved": "m"},
    "mass not moved": {"moved": "c"},
    "force without inertia": {"force_parts": "cx"},
    "force k_e y alone": {"force_parts": "x"},
    "record held between samples": {"ground": "held"},
    "lead on the error": {"lead": "error"},
    "backward differences": {"rule": "backward"},
    **{name: change for name, change in CONTROLLERS.items() if change},
    "converters rounded": {"converters": "rounded"},
    "converters clipped": {"converters": "clipped"},
}


def ground_motion(folder, name):
    """Record x 0.40 [m/s^2], straight lines between its points, at FS up to its last time."""
    time, acceleration = loadmat(folder / f"{name}AccelNoScaling.mat")[f"{name}Accel"]
    return SCALE * np.interp(np.arange(round(time[-1] * FS) + 1) * DT, time, acceleration)


def evaluate(case, ground, seeds, rules=Rules()):
    """{definition: (seeds, 9)}, and the largest stroke [mm], velocity [mm/s], force [N] a seed."""
    kept, against = simulate(case, ground, seeds, rules), reference_response(case, ground)
    storeys = np.stack([kept["x1"], kept["x2"], kept["x3"]], 1)
    found = {
        name: np.array([
            judge(storeys[..., j], kept["measured"][:, j], against) for j in range(len(seeds))
        ])
        for name, judge in DEFINITIONS.items()
    }  # fmt: skip
    units = {"stroke_mm": 1e3, "velocity_mm_s": 1e3, "force_N": 1.0}
    peaks = {name: unit * abs(kept[name.split("_")[0]]).max(0) for name, unit in units.items()}
    return found, peaks


def table(folder):
    """Rows of all records and cases; prints El Centro's beside the printed table."""
    rows = []
    for name in RECORDS:
        ground = ground_motion(folder, name)
        for case in CASES:
            found, largest = evaluate(case, ground, SEEDS)
            for definition, values in found.items():
                for j, (seed, row) in enumerate(zip(SEEDS, values, strict=True)):
                    peaks = {what: f"{value[j]:.2f}" for what, value in largest.items()}
                    rows.append({"record": name, "case": case, "definition": definition,
                                 "seed": "none" if seed is None else seed,
                                 **numbers(row), **peaks})  # fmt: skip
            show(name, case, found["script"][1:], largest)
    return rows


def numbers(row, digits=3):
    return {name: f"{value:.{digits}f}" for name, value in zip(NAMES, row, strict=True)}


def show(name, case, values, largest):
    stroke, velocity, force = (values.max() for values in largest.values())
    print(f"{name}, case {case}: {stroke:.2f} mm, {velocity:.0f} mm/s, {force:.0f} N")
    line("mean", values.mean(0))
    line("sd of noise", values.std(0, ddof=1))
    if name == "ElCentro":
        line("printed", PRINTED[case])


def line(label, values):
    print(f"  {label:32s}", *(f"{value:7.2f}" for value in values), flush=True)


def stability():
    """Rows: by case and controller the largest pole, what it means, and the reserve of delay."""
    rows = []
    for case, (_, ratio) in CASES.items():
        delay, frequency = critical_delays(case)[0]
        for label, change in CONTROLLERS.items():
            rules = replace(Rules(), **change)
            pole = Loop(case, rules).poles()[0]
            growth = FS * np.log(pole)
            spare = reserve(case, rules)
            rows.append({"case": case, "controller": label, "spectral_radius": f"{abs(pole):.8f}",
                         "frequency_Hz": f"{abs(growth.imag) / (2 * np.pi):.4f}",
                         "damping_percent": f"{-100 * growth.real / abs(growth):.3f}",
                         "reference_damping_percent": f"{100 * ratio:.0f}",
                         "spare_samples": "unstable" if spare is None else spare,
                         "critical_delay_ms": f"{1e3 * delay:.3f}",
                         "critical_frequency_Hz": f"{frequency:.3f}",
                         "critical_samples_stepped": critical_samples(case)})  # fmt: skip
            print(*rows[-1].values())
    return rows


def choices(folder):
    """Rows of what each choice makes of El Centro, noise seed 1: no indices if it is unstable."""
    ground, rows = ground_motion(folder, "ElCentro"), []
    for label, change in CHOICES.items():
        rules = replace(Rules(), **change)
        print(label)
        for case in CASES:
            radius = abs(Loop(case, replace(rules, converters="none")).poles()[0])
            row = {"choice": label, "case": case, "spectral_radius": f"{radius:.6f}"}
            if radius < 1:
                found = evaluate(case, ground, (1,), rules)[0]["script"][0]
                off = 100 * abs(found / PRINTED[case] - 1)
                row |= numbers(found, 2) | {"largest_departure_percent": f"{off.max():.1f}"}
                line(f"case {case}", found)
            rows.append(row)
    return rows


def write(path, rows):
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--records", type=Path, required=True)
    parser.add_argument("--out", type=Path, default=Path(__file__).parent / "results")
    parser.add_argument("--choices", action="store_true", help="what each choice moves, too")
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    write(given.out / "stability.csv", stability())
    print(f"  {'[ms, %]':32s}", *(f"{name:>7s}" for name in NAMES))
    write(given.out / "table.csv", table(given.records))
    if given.choices:
        write(given.out / "choices.csv", choices(given.records))


if __name__ == "__main__":
    main()
