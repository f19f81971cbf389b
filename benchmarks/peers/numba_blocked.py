"""Numba written for speed: trials side by side in blocks, blocks in parallel.

One sample of a block is one loop over its lanes whose body is straight-line scalar code, so that
the compiler turns every line into one vector instruction.  For that the body may touch a single
array only (otherwise run-time alias checks keep the loop scalar): the block's workspace `w`, whose
rows are `LANES` long.  Numba unrolls nothing by itself, so the body is written by the generator
below, matrices of the benchmark as literals.
"""

from __future__ import annotations

import math

import numpy as np
from job import LAG, LAGS, LEAD, NEVER, RUNAWAY_MM, VOLT_LIMIT, Job, Sums

from peers.wide_numba import numba

LANES = 8
TILE = 8  # samples whose correlations are added at a time
HISTORY = LAGS - 1
FASTMATH = {"contract", "nsz", "arcp"}
TRIANGLE = [(i, j) for i in range(8) for j in range(i, 8)]


class Rows:
    """Where each quantity lies in the workspace, in rows of lanes."""

    def __init__(self, **counts):
        self.at, self.count, total = {}, counts, 0
        for name, count in counts.items():
            self.at[name], total = total, total + count
        self.total = total

    def __call__(self, name: str, i: int = 0) -> str:
        return f"w[{(self.at[name] + i) * LANES} + l]"

    def of(self, name: str) -> slice:
        return slice(self.at[name], self.at[name] + self.count[name])


def workspace(states: int) -> Rows:
    """Rows of a block whose numerical substructure has so many states."""
    return Rows(
        # inputs of a sample, what leaves it, and the plants
        noise=1, left=4, entering=4, strokes=6, a=8, b=8, B=16, C=16,
        # state of the loop
        x=states, z=8, filtered=8, q1=2, q2=2, applied=2,
        # differences of estimates, of those that leave the window, of targets
        estimate=8, leaving=8, target=8,
        # normal equations, coefficients
        new=36, new_side=16, old=36, old_side=16, c=16,
        # results
        pairs=40, correlation=4 * LAGS, seen=3,
    )  # fmt: skip


def dot(coefficients, names) -> str:
    """Sum of coefficient times name; zero coefficients are left out."""
    terms = [f"{c!r} * {n}" for c, n in zip(map(float, coefficients), names, strict=True) if c]
    return " + ".join(terms) or "0.0"


def differences(r: Rows, state: str, newest, phi: str) -> list[str]:
    """Backward differences of order 0 to 4 and the regressor made of them."""
    lines = []
    for i in range(2):
        d = [f"{phi}d{i}{n}" for n in range(5)]
        lines.append(f"{d[0]} = {newest[i]}")
        lines += [f"{d[n + 1]} = {d[n]} - {r(state, 4 * i + n)}" for n in range(4)]
        lines += [f"{r(state, 4 * i + n)} = {d[n]}" for n in range(4)]
        values = (d[0], f"{d[1]} + 0.5 * {d[2]}", f"{d[2]} + {d[3]}", f"{d[3]} + 1.5 * {d[4]}")
        lines += [f"{phi}{4 * i + n} = {value}" for n, value in enumerate(values)]
    return lines


def least_squares(r: Rows, job: Job) -> list[str]:
    """Update the normal equations, factorise, and take the solution where it can be used."""
    pull, lines = float(job.scalars[2]), []
    for n, (i, j) in enumerate(TRIANGLE):
        lines += [
            f"new = {r('new', n)} + p{i} * p{j}",
            f"old = {r('old', n)} - o{i} * o{j}",
            f"{r('new', n)} = new",
            f"{r('old', n)} = old",
            f"m{i}{j} = new + old" + (f" + {pull!r}" if i == j else ""),
        ]
        lines += [f"g{i} = m{i}{j}"] if i == j else []
    for i in range(8):
        for s in range(2):
            n = 2 * i + s
            lines += [
                f"new = {r('new_side', n)} + p{i} * applied{s}",
                f"old = {r('old_side', n)} - o{i} * {r('left', 2 + s)}",
                f"{r('new_side', n)} = new",
                f"{r('old_side', n)} = old",
                f"m{i}{8 + s} = new + old + {pull * float(job.anchor[i, s])!r}",
            ]
    lines.append("good = due")
    for j in range(8):
        lines.append(f"good = good if m{j}{j} >= 1e-14 * g{j} else 0.0")
        lines.append(f"inverse{j} = 1.0 / m{j}{j}")
        for i in range(j + 1, 8):
            lines.append(f"f = m{j}{i} * inverse{j}")
            lines += [f"m{i}{k} = m{i}{k} - f * m{j}{k}" for k in range(i, 10)]
    for j in reversed(range(8)):
        for s in range(2):
            rest = "".join(f" - m{j}{i} * s{i}{s}" for i in range(j + 1, 8))
            lines.append(f"s{j}{s} = (m{j}{8 + s}{rest}) * inverse{j}")
    for j in range(8):
        for s in range(2):
            lines.append(f"c{j}{s} = s{j}{s} if good > 0.5 else {r('c', 2 * j + s)}")
            lines.append(f"{r('c', 2 * j + s)} = c{j}{s}")
    return lines


def coupler_to_frame(arm: float, alpha: float) -> list[str]:
    """q0, q1 from xhat0, xhat1; the angle by two half-angle steps and a series."""
    series = "0.0"
    for n in range(14, 0, -1):
        series = f"s * ({1 / (2 * n + 1)!r} - {series})"
    return [
        f"sine = (xhat0 - xhat1) * {1 / (2e3 * arm * math.sin(alpha))!r}",
        "cosine = math.sqrt(1.0 - sine * sine)",
        "half = sine / (1.0 + cosine)",
        f"q0 = (xhat0 + xhat1) * 0.0005 + {arm * math.cos(alpha)!r} * sine * half",
        "quarter = half / (1.0 + math.sqrt(1.0 + half * half))",
        "s = quarter * quarter",
        f"q1 = 4.0 * quarter * (1.0 - {series})",
    ]


def coupler_to_actuator(arm: float, alpha: float) -> list[str]:
    """xa0, xa1 from num0, num1."""
    series = "1.0"
    for n in range(8, 0, -1):
        series = f"(1.0 - s * {1 / (2 * n * (2 * n + 1))!r} * {series})"
    return [
        "s = 0.25 * num1 * num1",
        f"half = 0.5 * num1 * {series}",
        f"common = num0 - {2 * arm * math.cos(alpha)!r} * half * half",
        f"skew = {2 * arm * math.sin(alpha)!r} * half * math.sqrt(1.0 - half * half)",
        "xa0 = 1e3 * (common + skew)",
        "xa1 = 1e3 * (common - skew)",
    ]


def loop_before_controller(r: Rows, job: Job) -> list[str]:
    """Sensors, filter, coupler, force, substructure."""
    n, lines = job.num_a.size, []
    z, x, held = ([f"{v}{s}" for s in range(k)] for v, k in (("z", 8), ("x", n), ("f", 8)))
    corrected, load = [f"zc{s}" for s in range(8)], [f"load{i}" for i in range(4)]
    lines += [f"{z[s]} = {r('z', s)}" for s in range(8)]
    lines += [f"{held[s]} = {r('filtered', s)}" for s in range(8)]
    lines += [f"{x[s]} = {r('x', s)}" for s in range(n)]
    for i in range(2):
        seen = " + ".join(f"{r('C', 8 * i + s)} * {z[s]}" for s in range(8))
        lines.append(f"xm{i} = {r('noise')} + {seen}")
        lines.append(f"y{i} = xm{i} - ({dot(job.kal_C[i], held)})")
    for s in range(8):
        lines.append(f"{corrected[s]} = {held[s]} + {dot(job.kal_L[s], ('y0', 'y1'))}")
    lines += [f"xhat{i} = {dot(job.kal_C[i], corrected)}" for i in range(2)]
    lines += coupler_to_frame(*map(float, job.scalars[:2]))
    for i in range(2):
        lines += [
            f"before{i} = q{i} if k == 0 else {r('q1', i)}",
            f"earlier{i} = q{i} if k == 0 else {r('q2', i)}",
        ]
    lines.append("load0 = ground")
    past = [f"{name}{i}" for name in ("q", "before", "earlier") for i in range(2)]
    for f in range(3):
        lines.append(f"load{f + 1} = -({dot(job.restoring[:, f].ravel(), past)})")
    for i in range(2):
        lines += [f"{r('q1', i)} = q{i}", f"{r('q2', i)} = before{i}"]
    for o in range(6):
        both = dot([*job.num_C[o], *job.num_D[o]], [*x, *load])
        lines.append(f"num{o} = {both}")
    lines += coupler_to_actuator(*map(float, job.scalars[:2]))
    for s in range(n):
        names = (x[s], x[s ^ 1], *load)
        lines.append(f"{r('x', s)} = {dot([job.num_a[s], job.num_b[s], *job.num_B[s]], names)}")
    return lines


def loop_after_controller(r: Rows, job: Job) -> list[str]:
    """Command, plants and filter to k + 1, results."""
    lines = []
    for s in range(2):
        lines.append(f"u{s} = " + " + ".join(f"c{j}{s} * t{j}" for j in range(8)))
        lines += [f"{r('entering', s)} = xhat{s}", f"{r('entering', 2 + s)} = applied{s}"]
        lines.append(f"{r('applied', s)} = u{s}")
    for s in range(8):
        names = (f"zc{s}", f"zc{s ^ 1}", "u0", "u1")
        own = [f"{r('a', s)} * z{s}"]
        if np.any(job.plant_b[:, s]):
            own.append(f"{r('b', s)} * z{s ^ 1}")
        own += [f"{r('B', 2 * s + i)} * u{i}" for i in range(2) if np.any(job.plant_B[:, s, i])]
        lines.append(f"{r('z', s)} = {' + '.join(own)}")
        shared = dot([job.kal_a[s], job.kal_b[s], *job.kal_B[s]], names)
        lines.append(f"{r('filtered', s)} = {shared}")
    values = ("xm0", "xm1", "q0", "q1", "q0", "q1", "num2", "num3", "num4", "num5")
    targets = ("xa0", "xa1", "num0", "num1", *(f"ref{i}" for i in range(6)))
    for n, (value, target) in enumerate(zip(values, targets, strict=True)):
        at = [r("pairs", 4 * n + i) for i in range(4)]
        lines += [
            f"error = {value} - {target}",
            f"{at[0]} = {at[0]} + error * error",
            f"{at[1]} = {at[1]} + {target} * {target}",
            f"{at[2]} = max({at[2]}, abs(error))",
            f"{at[3]} = max({at[3]}, abs({target}))",
        ]
    for i in range(2):
        lines.append(
            f"volt{i} = abs(u{i} * {float(job.volt_per_mm[i])!r} + {float(job.volt_offset[i])!r})"
        )
    seen = [r("seen", i) for i in range(3)]
    lines += [
        "volts = max(volt0, volt1)",
        "largest = max(max(abs(u0), abs(u1)), max(abs(xm0), abs(xm1)))",
        # A NaN in one of the four is lost in `max`, but never in their sum.
        f"inside = largest <= {RUNAWAY_MM!r} and u0 + u1 + xm0 + xm1 < 1e300",
        f"{seen[0]} = min({seen[0]}, {NEVER!r} if inside else now)",
        f"{seen[1]} = min({seen[1]}, now if volts > {VOLT_LIMIT!r} else {NEVER!r})",
        f"{seen[2]} = max({seen[2]}, volts)",
    ]
    strokes = ("xa0", "xa1", "xm0", "xm1", "xhat0", "xhat1")
    return lines + [f"{r('strokes', i)} = {name}" for i, name in enumerate(strokes)]


def correlate_source(r: Rows) -> list[str]:
    """Functions that add a tile of samples to the correlations of one pair each."""
    lines = []
    for p in range(4):
        stroke = lambda row, i: f"s[(t + {row}) * {6 * LANES} + {i * LANES} + l]"  # noqa: E731
        lines += [f"def correlate_{p}(w, s, t):", f"    for l in range({LANES}):"]
        body = [f"y{i} = {stroke(i + LAG, 2 + p)}" for i in range(TILE)]
        body += [f"x{i} = {stroke(i, p % 2)}" for i in range(TILE + HISTORY)]
        for n in range(LAGS):  # lag n - LEAD of sample i stands LAG - lag rows after row i
            at = r("correlation", p * LAGS + n)
            terms = " + ".join(f"y{i} * x{i + HISTORY - n}" for i in range(TILE))
            body.append(f"{at} = {at} + {terms}")
        lines += [f"        {line}" for line in body]
    return lines


def kernels(r: Rows, job: Job):
    """The compiled functions of one sample and of the correlations."""
    estimates, leaving = ("xhat0", "xhat1"), (r("left", 0), r("left", 1))
    body = [
        *loop_before_controller(r, job),
        *differences(r, "estimate", estimates, "p"),
        *differences(r, "leaving", leaving, "o"),
        *differences(r, "target", ("xa0", "xa1"), "t"),
        *(f"applied{s} = {r('applied', s)}" for s in range(2)),
        *least_squares(r, job),
        *loop_after_controller(r, job),
    ]
    lines = ["def sample(w, k, now, due, ground, ref0, ref1, ref2, ref3, ref4, ref5):"]
    lines += [f"    for l in range({LANES}):", *(f"        {line}" for line in body)]
    lines += correlate_source(r)
    space = {
        "math": math,
        "max": numba.njit(lambda a, b: a if a > b else b, inline="always"),
        "min": numba.njit(lambda a, b: a if a < b else b, inline="always"),
    }
    exec("\n".join(lines), space)
    jit = numba.njit(fastmath=FASTMATH, error_model="numpy")
    return [jit(space[name]) for name in ("sample", *(f"correlate_{p}" for p in range(4)))]


@numba.njit
def aligned(size):
    """Zeros at a multiple of 64 bytes, so that no vector lies across two cache lines."""
    raw = np.zeros(size + 8)
    first = (-raw.ctypes.data % 64) // 8
    return raw[first : first + size]


def build(job: Job):
    """The compiled program of all blocks, and the layout of its workspace."""
    r = workspace(job.num_a.size)
    sample, correlate_0, correlate_1, correlate_2, correlate_3 = kernels(r, job)
    size, L = r.total * LANES, LANES
    at_noise, at_left, at_entering, at_strokes, at_plant, at_seen = (
        r.at[name] * LANES for name in ("noise", "left", "entering", "strokes", "a", "seen")
    )
    at_new, at_old, at_c = (r.at[name] * LANES for name in ("new", "old", "c"))

    @numba.njit(error_model="numpy")
    def one_block(ground, reference, noise, plants, start, nb, result):
        w, ring = aligned(size), aligned(nb * 4 * L)
        strokes = aligned((HISTORY + nb + 2 * TILE) * 6 * L)
        for i in range(plants.size):
            w[at_plant + i] = plants[i]
        for i in range(16):
            w[at_c + i * L : at_c + (i + 1) * L] = start[i]
        w[at_seen : at_seen + 2 * L] = NEVER
        N = ground.size
        for first in range(0, N, nb):
            n = min(nb, N - first)
            for j in range(n):
                k = first + j
                for l in range(L):
                    w[at_noise + l] = noise[k, l]
                for i in range(4 * L):
                    w[at_left + i] = ring[j * 4 * L + i]
                ref = reference[k]
                due = 1.0 if k >= nb + 4 else 0.0
                sample(
                    w, k, float(k), due, ground[k], ref[0], ref[1], ref[2], ref[3], ref[4], ref[5]
                )
                for i in range(4 * L):
                    ring[j * 4 * L + i] = w[at_entering + i]
                for i in range(6 * L):
                    strokes[(HISTORY + j) * 6 * L + i] = w[at_strokes + i]
            # After the record come zeros, so that its last samples meet all their lags.
            rows = n if first + n < N else n + LEAD
            strokes[(HISTORY + n) * 6 * L :] = 0.0
            for t in range(0, rows, TILE):
                correlate_0(w, strokes, t)
                correlate_1(w, strokes, t)
                correlate_2(w, strokes, t)
                correlate_3(w, strokes, t)
            strokes[: HISTORY * 6 * L] = strokes[n * 6 * L : (n + HISTORY) * 6 * L].copy()
            for i in range(52 * L):
                w[at_old + i] = w[at_new + i]
                w[at_new + i] = 0.0
        result[:] = w

    @numba.njit(parallel=True)
    def all_blocks(ground, reference, noise, plants, start, nb, results):
        for b in numba.prange(plants.shape[0]):
            one_block(ground, reference, noise[b], plants[b], start, nb, results[b])

    return all_blocks, r


def prepare(job: Job):
    """A function without arguments that runs the job."""
    program, r = build(job)
    T = job.trials
    lanes = np.minimum(np.arange(-(-T // LANES) * LANES), T - 1).reshape(-1, LANES)
    plants = [job.plant_a, job.plant_b, job.plant_B.reshape(T, 16), job.plant_C.reshape(T, 16)]
    plants = np.concatenate(plants, axis=1)[lanes]  # (blocks, lanes, 48)
    plants = np.ascontiguousarray(np.swapaxes(plants, 1, 2)).reshape(len(lanes), -1)
    noise = np.empty((len(lanes), job.samples, LANES))
    for b, which in enumerate(lanes):
        noise[b] = job.noise[:, which]

    def run() -> Sums:
        results = np.empty((len(lanes), r.total * LANES))
        start = np.ascontiguousarray(job.start).ravel()
        program(job.ground, job.reference, noise, plants, start, job.nb, results)
        by_trial = np.moveaxis(results.reshape(len(lanes), r.total, LANES), 1, 2)
        by_trial = by_trial.reshape(-1, r.total)[:T]
        take = lambda name, *shape: by_trial[:, r.of(name)].reshape(T, *shape)  # noqa: E731
        return Sums(take("pairs", 10, 4), take("correlation", 4, LAGS), *take("seen", 3).T)

    return run
