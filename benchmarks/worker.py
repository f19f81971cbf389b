"""One program in a process of its own, so that its memory and its start are its own.

    python benchmarks/worker.py job   FOLDER '{"motion": ..., "records": ..., "trials": ...}'
    python benchmarks/worker.py peer  FOLDER '{"name": ..., "trials": ..., "samples": ...}'
    python benchmarks/worker.py cost  FOLDER '{"cases": [...], "rounds": ...}'

`compare.py` starts these; answers are lines of JSON.  A peer waits for orders on its standard
input: `run`, `indices TRIALS SAMPLES FILE` and `quit`.
"""

from __future__ import annotations

import importlib
import json
import resource
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
from job import Job, build_job

SEED = 1


def answer(**content) -> None:
    print(json.dumps(content), flush=True)


def peak_mib() -> float:
    """Largest resident memory of this process so far [MiB]."""
    try:  # getrusage would count the process that started this one
        for line in Path("/proc/self/status").read_text().splitlines():
            if line.startswith("VmHWM"):
                return int(line.split()[1]) / 1024
    except OSError:
        pass
    unit = 2**20 if sys.platform == "darwin" else 2**10
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / unit


def make_job(folder: Path, motion: str, records: str | None, trials: int, scale: float) -> None:
    """Build and save the job; the motion begins where it first exceeds 1 % of its peak."""
    from martths_jax import Motion, load_motion

    whole = load_motion(motion, scale=scale, fs=1024, records=records)
    a = np.asarray(whole.acceleration)
    a = a[np.argmax(np.abs(a) > 0.01 * np.abs(a).max()) :]
    build_job(Motion(whole.name, a, 1024.0), trials, SEED).save(folder)
    answer(motion=whole.name, samples=a.size)


def serve(folder: Path, name: str, trials: int, samples: int) -> None:
    """Answer orders about one peer until told to quit."""
    peer = importlib.import_module(f"peers.{name}")
    run = peer.prepare(Job.load(folder, trials, samples))
    answer(ready=name)
    outcome = None
    for order in sys.stdin:
        verb, *rest = order.split()
        if verb == "run":
            started = time.perf_counter()
            outcome = run()
            answer(seconds=time.perf_counter() - started)
        elif verb == "indices":
            size = (int(rest[0]), int(rest[1]))
            memory = peak_mib()
            if size != (trials, samples):
                outcome = peer.prepare(Job.load(folder, *size))()
            np.save(rest[2], outcome.indices())
            answer(peak_mib=memory)
        else:
            break


def measure(folder: Path, cases: list[dict], rounds: int) -> None:
    """Time this engine on each case, all cases in turn."""
    import jax

    from martths_jax import (
        ADFC,
        LQG,
        Motion,
        SensorNoise,
        build_benchmark,
        draw_plants,
        indices,
        simulate,
    )
    from martths_jax.simulation import LANES

    bench, devices = build_benchmark(), len(jax.local_devices())
    ground = np.load(folder / "ground.npy")

    def program(case, trials):
        nb = case["nb"]
        adfc = case["controller"] == "adfc"
        controller = ADFC(nb=nb, no=nb - 1) if adfc else LQG.design(bench)
        motion = Motion("benchmark", np.resize(ground, case["samples"]), bench.fs)
        plants, noise = draw_plants(trials, seed=SEED), SensorNoise(seed=SEED)
        return lambda: simulate(bench, controller, plants, motion, noise)

    runs, times = [program(case, case["trials"]) for case in cases], [[] for _ in cases]
    for case in cases:  # compiles what it needs
        started = time.perf_counter()
        block = program(case, min(case["trials"], LANES * devices))()
        lanes = np.arange(case["trials"]) % len(block.trial)
        many = lambda tree, lanes=lanes: jax.tree.map(lambda x: x[lanes], tree)  # noqa: E731
        indices(replace(block, sums=many(block.sums), watch=many(block.watch)))
        answer(warm=case["table"], seconds=time.perf_counter() - started)
    for turn in range(rounds):
        for i, case in enumerate(cases):
            if turn < case.get("rounds", rounds):
                started = time.perf_counter()
                indices(runs[i]())
                times[i].append(time.perf_counter() - started)
                answer(done=case["table"], value=case["value"], seconds=times[i][-1])
    answer(times=times, devices=devices, peak_mib=peak_mib())


if __name__ == "__main__":
    mode, at, given = sys.argv[1], Path(sys.argv[2]), json.loads(sys.argv[3])
    {"job": make_job, "peer": serve, "cost": measure}[mode](at, **given)
