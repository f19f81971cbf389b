"""How fast this engine is beside other programs of the same job, and what its time grows with.

    python benchmarks/compare.py                         # everything, about ten minutes
    python benchmarks/compare.py peers --records DIR     # on a real record
    python benchmarks/compare.py cost --tables trials nb
    python benchmarks/compare.py --quick                 # small, to see that all of it works

Programs run in processes of their own and take turns; times are medians, ratios the medians of
those within a turn.  Tables are printed and written to benchmarks/results/ as Markdown and CSV.
Run it on a machine that does nothing else.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from statistics import median

import numpy as np
from report import describe_machine, write_tables

HERE = Path(__file__).parent
#: Program, what it is, whether it is far too slow for the whole job.
PROGRAMS = {
    "engine": ("this engine, `simulate`, draws its noise", False),
    "engine_ready": ("this engine as in a study, noise drawn before", False),
    "numba_blocked": ("Numba, blocks of 8 lanes, loop body generated", False),
    "c_by_hand": ("C, vectorised by hand (gcc -ffast-math)", False),
    "numba_lanes": ("Numba, trials blocked by hand, a loop over lanes in every line", False),
    "numba_scalar": ("Numba, one scalar loop a trial", False),
    "numpy_trials": ("NumPy, vectorised over trials", True),
    "jax_plain": ("JAX, plain vmap and jnp.linalg.solve", True),
}
#: Programs that compile in their first run.
COMPILED = ("engine", "engine_ready", "numba_blocked", "numba_lanes", "numba_scalar", "jax_plain")
SLOW_SAMPLES = 1536
#: Rows of J1 and J4 among the 24: whole samples, so they agree or differ by one.
DELAYS = [0, 1, 6, 7]
SAMPLE_MS = 1.001 / 1.024
#: Two programs agree if the relative difference of their other indices stays below this in the
#: median and in the worst case (the fit amplifies round-off by up to its condition number).
AGREEMENT = (1e-10, 1e-3)


@dataclass
class Sizes:
    """How much work is done."""

    trials: int = 1000
    samples: int | None = None  # None: the whole record
    slow_trials: int = 1000
    rounds: int = 5
    slow_rounds: int = 2
    cost_rounds: int = 3
    cost_trials: tuple = (1, 10, 100, 250, 500, 1000, 2000, 10000)
    cost_lengths: tuple = (4096, 8192, 16384, 32768, 65536, 131072)
    length_trials: int = 256
    cost_nb: tuple = (128, 256, 512, 1024, 2048, 4096)
    cost_devices: tuple = (1, 2)


QUICK = Sizes(128, 4096, 16, 2, 1, 1, (1, 64, 128), (2048, 4096), 64, (256,), (1, 2))


class Process:
    """A peer in a process of its own."""

    def __init__(self, name: str, folder: Path, trials: int, samples: int, env=None):
        given = json.dumps({"name": name, "trials": trials, "samples": samples})
        self.name, self.trials, self.samples, self.times = name, trials, samples, []
        self.process = subprocess.Popen(
            [sys.executable, str(HERE / "worker.py"), "peer", str(folder), given],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            # An empty cache: it has to compile.
            env=os.environ | {"MARTHS_CACHE": str(folder / "cache")} | (env or {}),
        )

    def hear(self) -> dict | None:
        """The next line of JSON; None if the process has ended."""
        for line in self.process.stdout:
            if line.startswith("{"):
                return json.loads(line)
        return None

    def ask(self, order: str) -> dict:
        """Give an order and wait for the answer."""
        print(order, file=self.process.stdin, flush=True)
        told = self.hear()
        if told is None:
            raise SystemExit(f"{self.name} stopped:\n{self.process.stderr.read()}")
        return told

    def indices(self, folder: Path, trials: int, samples: int) -> tuple[np.ndarray, float]:
        """(24, trials) indices of a job, and the peak memory before [MiB]."""
        path = folder / f"{self.name}-{trials}-{samples}.npy"
        memory = self.ask(f"indices {trials} {samples} {path}")["peak_mib"]
        return np.load(path), memory

    def close(self) -> None:
        self.process.communicate("quit\n")


def say(text: str) -> None:
    print(f"{time.strftime('%H:%M:%S')}  {text}", file=sys.stderr, flush=True)


def worker(mode: str, folder: Path, given: dict) -> dict:
    """Last answer of a worker that runs through."""
    done = None
    with subprocess.Popen(
        [sys.executable, str(HERE / "worker.py"), mode, str(folder), json.dumps(given)],
        stdout=subprocess.PIPE,
        text=True,
    ) as process:
        for line in process.stdout:
            if line.startswith("{"):
                done = json.loads(line)
                if mode == "cost" and "times" not in done:
                    say(" ".join(f"{k} {v:.3g}" if isinstance(v, float) else f"{k} {v}"
                                 for k, v in done.items()))  # fmt: skip
    if process.returncode:
        raise SystemExit(f"The worker `{mode}` ended with code {process.returncode}.")
    return done


def start_peers(names, folder: Path, sizes: Sizes, samples: int) -> list[Process]:
    """Start the programs, one after the other; those that cannot start are left out."""
    peers = []
    for name in names:
        slow = PROGRAMS[name][1]
        size = (sizes.slow_trials, min(SLOW_SAMPLES, samples)) if slow else (sizes.trials, samples)
        peer = Process(name, folder, *size)
        if peer.hear() is None:
            reason = peer.process.stderr.read().strip().splitlines()[-1:]
            say(f"{name} left out: {' '.join(reason)}")
            continue
        first = peer.ask("run")["seconds"]
        peer.first = first
        peers.append(peer)
        say(f"{name}: first run {first:.1f} s")
    return peers


def compare_peers(folder: Path, sizes: Sizes, names, samples: int) -> list[dict]:
    """Rows of the table of programs."""
    peers = start_peers(["engine", *(n for n in names if n != "engine")], folder, sizes, samples)
    engine = peers[0]
    take_turns(peers, sizes)
    rows = []
    for peer in peers:
        seconds = median(peer.times)
        theirs, memory = peer.indices(folder, peer.trials, peer.samples)
        ours, _ = engine.indices(folder, peer.trials, peer.samples)
        middle, worst, delays = difference(theirs, ours)
        rows.append(
            {
                "program": PROGRAMS[peer.name][0],
                "trials": peer.trials,
                "samples": peer.samples,
                "seconds": seconds,
                "trial_samples_per_s": peer.trials * peer.samples / seconds,
                "compile_s": peer.first - seconds if peer.name in COMPILED else None,
                "peak_MiB": memory,
                "median_difference": middle,
                "worst_difference": worst,
                "delays_that_differ": delays,
                "agrees": middle < AGREEMENT[0] and worst < AGREEMENT[1],
            }
        )
        say(f"{peer.name}: indices differ by {middle:.1e} (median), {worst:.1e} (worst); "
            f"{delays} delays differ")  # fmt: skip
    ready = next((peer for peer in peers if peer.name == "engine_ready"), None)
    for row, peer in zip(rows, peers, strict=True):
        row["engine_is_faster_by"] = faster(engine, peer)
        row["ready_is_faster_by"] = faster(ready, peer) if ready else None
    for peer in peers:
        peer.close()
    return rows


def take_turns(peers: list[Process], sizes: Sizes) -> None:
    """Time the programs, one run of each after the other, the slow ones less often."""
    for turn in range(sizes.rounds):
        for peer in peers:
            if turn < (sizes.slow_rounds if PROGRAMS[peer.name][1] else sizes.rounds):
                peer.times.append(peer.ask("run")["seconds"])
                say(f"{peer.name}: {peer.times[-1]:.2f} s")


def faster(one: Process, other: Process) -> float:
    """How many times the rate of another program one has: the median of the rounds' ratios."""
    work = one.trials * one.samples / (other.trials * other.samples)
    return median(b / a * work for a, b in zip(one.times, other.times, strict=False))


def difference(theirs: np.ndarray, ours: np.ndarray) -> tuple[float, float, int]:
    """Median and largest relative difference of two tables (24, T), and how many delays differ;
    infinite if other trials ran away in one than in the other, or a delay is off by more than one
    sample."""
    if not np.array_equal(np.isnan(theirs), np.isnan(ours)):
        return np.inf, np.inf, theirs.shape[1]
    kept = ~np.isnan(ours[0])
    theirs, ours = theirs[:, kept], ours[:, kept]
    apart = np.abs(theirs - ours)
    if np.any(apart[DELAYS] > SAMPLE_MS):
        return np.inf, np.inf, theirs.shape[1]
    relative = np.delete(apart, DELAYS, axis=0) / np.abs(np.delete(ours, DELAYS, axis=0))
    delays = int(np.count_nonzero(apart[DELAYS] > 1e-6))
    return float(np.median(relative)), float(np.max(relative)), delays


def cost_cases(sizes: Sizes, samples: int, tables) -> list[dict]:
    """The cases of the cost tables that one process measures."""
    usual = {"controller": "adfc", "nb": 1024, "trials": sizes.length_trials, "samples": samples}
    cases = [
        *({"table": "trials", "value": n, "trials": n} for n in sizes.cost_trials),
        *({"table": "length", "value": n, "samples": n} for n in sizes.cost_lengths),
        *({"table": "nb", "value": n, "nb": n} for n in sizes.cost_nb),
        *({"table": "controller", "value": c, "controller": c} for c in ("adfc", "lqg")),
    ]
    longest = max(sizes.cost_trials)
    return [
        usual | case | ({"rounds": 1} if case.get("trials") == longest else {})
        for case in cases
        if case["table"] in tables
    ]


def measure_cost(folder: Path, sizes: Sizes, samples: int, tables) -> list[dict]:
    """Rows of all cost tables."""
    cases, rows = cost_cases(sizes, samples, tables), []
    if cases:
        told = worker("cost", folder, {"cases": cases, "rounds": sizes.cost_rounds})
        for case, times in zip(cases, told["times"], strict=True):
            rows.append(cost_row(case, told["devices"], times))
    if "devices" in tables:
        rows += compare_devices(folder, sizes, samples)
    return rows


def compare_devices(folder: Path, sizes: Sizes, samples: int) -> list[dict]:
    """Rows of one engine a number of devices; they take turns."""
    engines = [
        Process("engine", folder, sizes.trials, samples, {"MARTHS_DEVICES": str(n)})
        for n in sizes.cost_devices
    ]
    for engine in engines:
        engine.hear()
        engine.ask("run")
    take_turns(engines, sizes)
    case = {"table": "devices", "controller": "adfc", "nb": 1024, "samples": samples}
    rows = []
    for n, engine in zip(sizes.cost_devices, engines, strict=True):
        row = cost_row(case | {"value": n, "trials": sizes.trials}, n, engine.times)
        rows.append(row | {"relative": faster(engine, engines[0])})
        engine.close()
    return rows


def cost_row(case: dict, devices: int, times: list[float]) -> dict:
    """One row of a cost table."""
    names = ("table", "value", "controller", "nb", "trials", "samples")
    return {name: case[name] for name in names} | {
        "devices": devices,
        "seconds": median(times),
        "runs": len(times),
        "trial_samples_per_s": case["trials"] * case["samples"] / median(times),
        "relative": None,
    }


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("parts", nargs="*", default=["peers", "cost"], help="peers, cost")
    parser.add_argument("--motion", help="built-in motion, name in --records or path")
    parser.add_argument("--records", help="folder of the real records")
    parser.add_argument("--scale", type=float, default=0.4)
    parser.add_argument("--programs", nargs="+", default=list(PROGRAMS), choices=PROGRAMS)
    tables = ("trials", "length", "nb", "controller", "devices")
    parser.add_argument("--tables", nargs="+", default=tables, choices=tables)
    parser.add_argument("--quick", action="store_true", help="small sizes, nothing is written")
    parser.add_argument("--out", type=Path, help="folder of the tables (benchmarks/results)")
    given = parser.parse_args()
    for part in given.parts:
        if part not in ("peers", "cost"):
            parser.error(f"argument parts: must be peers or cost, but got {part}")
    return given


def main() -> int:
    given = arguments()
    sizes = QUICK if given.quick else Sizes()
    out = given.out or (None if given.quick else HERE / "results")
    motion = given.motion or ("elcentro" if given.records else "elcentro-like")
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        job = {"motion": motion, "records": given.records, "trials": sizes.trials}
        told = worker("job", folder, job | {"scale": given.scale})
        samples = min(told["samples"], sizes.samples or told["samples"])
        about = describe_machine() | {"motion": f"{told['motion']}, scale {given.scale:g}"}
        found = {}
        if "peers" in given.parts:
            found["peers"] = compare_peers(folder, sizes, given.programs, samples)
        if "cost" in given.parts:
            found["cost"] = measure_cost(folder, sizes, samples, given.tables)
    write_tables(found, about, out)
    disagree = [row["program"] for row in found.get("peers", []) if not row["agrees"]]
    if disagree:
        say(f"Indices do not agree: {', '.join(disagree)}")
    return bool(disagree)


if __name__ == "__main__":
    sys.exit(main())
