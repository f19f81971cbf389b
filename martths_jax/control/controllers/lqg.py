"""LQG tracking control of the benchmark: state feedback on the estimate plus integral action."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from scipy import linalg

from martths_jax.benchmark import LAYOUT, Benchmark
from martths_jax.control.base import Controller, Decision
from martths_jax.control.design.closed_loop import lowest_stable_rate, nominal_radius
from martths_jax.control.design.lqg import WEIGHTS, kalman_gain, tracking_gains
from martths_jax.control.entry import ANY, Entry, Parameter
from martths_jax.control.estimators import KalmanFilter, design_kalman
from martths_jax.errors import InputError, argument_error, as_numbers
from martths_jax.runtime import check_precision, check_runtime
from martths_jax.structure.modal import contract

#: What is integrated -> weights fitted to Table 4's LQG column with it (experiments/calibrate_lqg).
FITTED = {
    "estimate": {
        "e": (10**9.902, 10**3.753),
        "r": (1.0, 10**-1.009),
        "y": (10**0.784, 10**1.566),
        "q": 3e-3,
    },
    "measured": {
        "e": (10**9.766, 10**3.738),
        "r": (1.0, 10**-0.907),
        "y": (10**0.699, 10**1.580),
        "q": 3e-5,
    },
}


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class LQG(Controller):
    """u(k) = -K_z z_hat(k) - K_e e(k), with e(k) = e(k-1) + dt (x_a(k) - x(k)).

    Attributes:
        K_z: (n, 2, m) or (n, 2, m, T) gain on the estimated plant state, slot by slot; n actuators.
        K_e: (n, n) or (n, n, T) gain on the integral of the tracking error [1/s].
        estimator: the Kalman filter.
        weights: what the gains were designed from, for the record.
        error: what x is, and so which error is integrated: the ``measured`` strokes x_m, or the
            filter's ``estimate`` x_hat of them.
    """

    K_z: jax.Array
    K_e: jax.Array
    estimator: Any
    weights: tuple = field(default=(), metadata={"static": True})
    error: str = field(default="measured", metadata={"static": True})

    name = "lqg"
    shared_axes = MappingProxyType({"K_z": 3, "K_e": 2})

    @classmethod
    def design(
        cls,
        benchmark,
        *,
        e: Sequence[float] | None = None,
        r: Sequence[float] | None = None,
        y: Sequence[float] | None = None,
        q: float | None = None,
        error: str = "estimate",
        allow_unstable: bool = False,
    ) -> LQG:
        """Gains from the continuous-time Riccati equation of the plant with integral action.

        Minimises the integral of x' diag(y) x + e' diag(e) e + u' diag(r) u for the augmented
        state (z, e), e' = x_a - C z.

        Args:
            benchmark: gives the nominal plant and the sensor noise.
            e: weights of the integrated errors, one an actuator [1/s^2].
            r: weights of the commands [-].
            y: weights of the strokes [-].
            q: process noise of the Kalman filter [mm^2].
            error: integrate that of the ``estimate`` or of the ``measured`` strokes.
            allow_unstable: return a design whose loop runs away on the benchmark's own plant, too.

        The published weights are not known.  Those left out are ``FITTED`` for `error`: the
        least-squares fit of e, r and y to Table 4's LQG column, which says next to nothing of q.
        The Riccati equation is the same for both errors, as it knows no noise.  For another problem
        than the one of the fit all weights have to be given.

        Raises:
            InputError: if a weight is not positive (y may be zero) or traced, no solution exists,
                `error` is neither of the two, or the loop is unstable on the maRTHS benchmark's own
                plant at its sampling rate; of another problem's loop ``stability`` tells.
        """
        check_runtime()
        if not isinstance(benchmark, Benchmark):
            got = type(benchmark).__name__
            raise argument_error("benchmark", "be a Benchmark", got, "Use build_benchmark().")
        if error not in FITTED:
            raise argument_error("error", f"be one of {sorted(FITTED)}", repr(error))
        given = {"e": e, "r": r, "y": y, "q": q}
        given = {name: w for name, w in given.items() if w is not None}
        if benchmark.layout == LAYOUT:
            given = FITTED[error] | given
        elif missing := [name for name in "eryq" if name not in given]:
            raise argument_error(
                ", ".join(missing), "be given for a problem other than the maRTHS benchmark",
                "nothing", "The default weights are a fit to that benchmark's table.",
            )  # fmt: skip
        e, r, y, q = (given[name] for name in "eryq")
        i = len(benchmark.layout.actuators)
        check_weights(e, r, y, q, i)
        A, B, C = benchmark.plant_continuous
        n = A.shape[0]
        A_aug = np.block([[A, np.zeros((n, i))], [-C, np.zeros((i, i))]])
        B_aug = np.vstack([B, np.zeros((i, i))])
        Q = linalg.block_diag(C.T @ np.diag(y) @ C, np.diag(e))
        try:
            with np.errstate(all="ignore"):
                X = linalg.solve_continuous_are(A_aug, B_aug, Q, np.diag(r))
        except (np.linalg.LinAlgError, ValueError) as reason:
            raise argument_error(
                "e, r, y", "give a solvable Riccati equation", f"e={e}, r={r}, y={y} ({reason})"
            ) from None
        K = np.linalg.solve(np.diag(r), B_aug.T @ X)
        K_z = np.swapaxes(K[:, :n].reshape(i, n // 2, 2), 1, 2)
        with jax.ensure_compile_time_eval():  # the numbers are known, under jit too
            made = cls(
                K_z=jnp.asarray(K_z),
                K_e=jnp.asarray(K[:, n:]),
                estimator=design_kalman(benchmark.plant_model, q, benchmark.r_mm2),
                weights=(("e", tuple(e)), ("r", tuple(r)), ("y", tuple(y)), ("q", float(q))),
                error=error,
            )
        if not allow_unstable and benchmark.layout == LAYOUT:
            refuse_unstable(benchmark, made, q)
        return made

    def problems(self, benchmark):
        if self.error in FITTED:
            return []
        return [str(argument_error("error", f"be one of {sorted(FITTED)}", repr(self.error)))]

    def prepare(self, benchmark):
        # Designs that differ in numbers only share a program, and can be mixed trial by trial.
        return replace(self, weights=())

    def init(self, trials):
        return jnp.zeros((self.K_e.shape[0], trials))

    def step(self, state, seen):
        reached = seen.x_m if self.error == "measured" else seen.x_hat
        error = state + seen.dt * (seen.x_a - reached)
        command = -contract(self.K_z, seen.state, axes=2) - contract(self.K_e, error)
        return error, Decision(u=command, signals={"error_integral": error})


def _pairs(w) -> dict:
    """Settings of ``LQG.design`` that mean the same as the tuned numbers."""
    # What a tuning has found is shown even if it runs away in the end.
    found = {"e": (w["e1"], w["e2"]), "r": (1.0, w["r2"]), "y": (w["y1"], w["y2"]), "q": w["q"],
             "allow_unstable": True}  # fmt: skip
    return found | {name: value for name, value in w.items() if name not in WEIGHTS}


def _traced(benchmark, *, e1, e2, r2, y1, y2, q, error: str = "estimate") -> LQG:
    if len(benchmark.layout.actuators) != 2:
        raise InputError("LQG's weights can be tuned for two actuators only; give them instead.")
    values = {"e1": e1, "e2": e2, "r2": r2, "y1": y1, "y2": y2, "q": q}
    logs = {name: jnp.log10(value) for name, value in values.items()}
    return lqg_from_weights(benchmark, logs, error)


def _tuned() -> tuple[Parameter, ...]:
    found = FITTED["estimate"]
    (e1, e2), (r1, r2), (y1, y2) = (found[name] for name in "ery")
    starts = {"e1": e1, "e2": e2, "r2": r2 / r1, "y1": y1, "y2": y2, "q": found["q"]}
    units = {"e1": "1/s^2", "e2": "1/s^2", "q": "mm^2"}
    return tuple(
        Parameter(name, default=starts[name], unit=units.get(name, "1"), low=0.0, above=True)
        for name in WEIGHTS
    )


ENTRY = Entry(
    name="lqg",
    controller=LQG,
    make=LQG.design,
    label="LQG",
    paper="Condori Uribe et al. 2023, sample controller of the benchmark",
    parameters=(
        Parameter("e", "e", "weights of the integrated errors", None, "1/s^2", 0.0, above=True,
                  size=ANY),
        Parameter("r", "r", "weights of the commands", None, "1", 0.0, above=True, size=ANY),
        Parameter("y", "y", "weights of the strokes", None, "1", 0.0, size=ANY),
        Parameter("q", "q", "process noise", None, "mm^2", 0.0, above=True),
        Parameter("error", "", "error that is integrated", "estimate", choices=tuple(FITTED),
                  kind="static"),
        Parameter("allow_unstable", "", "take designs that run away", False, kind="static"),
    ),
    tuned=_tuned(),
    traced=_traced,
    settings_from=_pairs,
    look=0,
)  # fmt: skip


def lqg_from_weights(
    benchmark: Benchmark, log_weights: Mapping[str, jax.Array], error: str = "estimate"
) -> LQG:
    """LQG controller from log10 of its weights, in pure JAX.

    The same design as ``LQG.design``, which checks its arguments and uses SciPy on the host; this
    one can be traced, differentiated and batched.

    Args:
        benchmark: gives the nominal plant and the sensor noise.
        log_weights: log10 of each of ``WEIGHTS``: integrated errors e1, e2 [1/s^2], second command
            r2, strokes y1, y2 [-], process noise q of the filter [mm^2].  Scalars.
        error: which one is integrated, as in ``LQG``.

    Returns:
        The controller of ``LQG.design`` for e = (e1, e2), r = (1, r2), y = (y1, y2), q, `error`.
    """
    check_precision()
    w = {name: 10.0 ** jnp.asarray(log_weights[name], dtype=float) for name in WEIGHTS}
    C = benchmark.plant_continuous[2]
    n = C.shape[1]
    blank, one = jnp.zeros((n, 2)), jnp.ones(())
    strokes = C.T @ (jnp.stack([w["y1"], w["y2"]])[:, None] * C)
    errors = jnp.diag(jnp.stack([w["e1"], w["e2"]]))
    Q = jnp.block([[strokes, blank], [blank.T, errors]])
    R = jnp.diag(jnp.stack([one, w["r2"]]))
    K_z, K_e = tracking_gains(benchmark, Q, R)
    estimator = KalmanFilter(benchmark.plant_model, kalman_gain(benchmark, w["q"]))
    return LQG(K_z=K_z, K_e=K_e, estimator=estimator, error=error)


def check_weights(e, r, y, q, actuators: int = 2) -> None:
    """Refuse weights of ``LQG.design`` that are no numbers, out of range or not one an actuator.

    Raises:
        InputError: naming the first such weight.
    """
    for name, given, shape, low in (
        ("e", e, (actuators,), 0.0), ("r", r, (actuators,), 0.0), ("y", y, (actuators,), -1e-300),
        ("q", q, (), 0.0),
    ):  # fmt: skip
        count = {2: "two"}.get(actuators, str(actuators)) if shape else "a"
        plural = "s" if shape and actuators > 1 else ""
        wanted = f"be {count} {'positive' if low == 0 else 'non-negative'} number{plural}"
        if any(isinstance(x, jax.core.Tracer) for x in jax.tree.leaves(given)):
            raise argument_error(
                name, wanted, "a traced value",
                "martths_jax.control.design.lqg.lqg_from_weights can be traced and differentiated.",
            )  # fmt: skip
        values = as_numbers(given)
        if values.shape != shape or not np.all(np.isfinite(values) & (values > low)):
            raise argument_error(name, wanted, repr(given)[:80])


def refuse_unstable(benchmark, made: LQG, q: float) -> None:
    """Refuse a design whose loop runs away on the plant it was made for.

    Raises:
        InputError: with the lowest sampling rate that holds, where that is the cause.
    """
    step = jax.tree.map(np.asarray, replace(made, estimator=None)).step
    radius = nominal_radius(benchmark, made.estimator.filter_gain, step)
    if radius < 1:
        return
    lowest = lowest_stable_rate(benchmark, q, step)
    remedy = "Raise r or lower e"
    if lowest is not None:
        remedy = (
            f"With these weights the lowest sampling rate that holds is {lowest:g} Hz; raise fs"
        )
    raise argument_error(
        "e, r, y, q",
        "give a loop that is stable on the nominal plant",
        f"one with a pole of magnitude {radius:.6g} at {benchmark.fs:g} Hz",
        f"{remedy}, or design with allow_unstable=True to see it run away.",
    )
