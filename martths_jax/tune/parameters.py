"""What can be tuned: log10 of a controller's positive numbers, and the controller they make."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import jax.numpy as jnp
import numpy as np

from martths_jax.benchmark import Benchmark
from martths_jax.control.controllers import ADFC, LQG, Controller
from martths_jax.control.controllers.adfc import GUARD_PULL
from martths_jax.control.controllers.lqg import FITTED, lqg_from_weights
from martths_jax.control.design.lqg import WEIGHTS, kalman_gain
from martths_jax.control.estimators import KalmanFilter
from martths_jax.errors import argument_error

#: Controller -> its tunable numbers: LQG's weights, or ADFC's pull towards the inverse plant, and
#: the filter's q.
TUNABLE = {"lqg": WEIGHTS, "adfc": ("pull", "q")}


def start_of(controller: str, given: Mapping[str, float] | None = None) -> dict[str, float]:
    """log10 of the numbers that tuning starts from: the defaults, and what is given instead.

    Raises:
        InputError: for an unknown controller or number, or a value that is not positive.
    """
    if controller not in TUNABLE:
        raise argument_error("controller", f"be one of {sorted(TUNABLE)}", repr(controller))
    if controller == "lqg":
        fitted = FITTED[LQG.design.__func__.__kwdefaults__["error"]]
        (e1, e2), (r1, r2), (y1, y2) = (fitted[name] for name in "ery")
        values = dict(e1=e1, e2=e2, r2=r2 / r1, y1=y1, y2=y2, q=fitted["q"])
    else:
        values = {"pull": GUARD_PULL, "q": ADFC().q}
    for name, value in (given or {}).items():
        if name not in values:
            raise argument_error("start", f"name one of {', '.join(values)}", repr(name))
        if not 0 < value < float("inf"):
            raise argument_error("start", f"give a positive {name}", value)
        values[name] = value
    return {name: float(np.log10(value)) for name, value in values.items()}


def build(controller: str, benchmark: Benchmark, logs: Mapping) -> Controller:
    """Prepared controller from log10 of its numbers, which may be traced."""
    if controller == "lqg":
        return lqg_from_weights(benchmark, logs)
    prepared = ADFC().prepare(benchmark)
    gain = kalman_gain(benchmark, 10.0 ** jnp.asarray(logs["q"]))
    return replace(
        prepared,
        pull=10.0 ** jnp.asarray(logs["pull"]),
        q=10.0 ** jnp.asarray(logs["q"]),
        estimator=KalmanFilter(prepared.estimator.model, gain),
    )


def host_controller(controller: str, benchmark: Benchmark, logs: Mapping[str, float]) -> Controller:
    """The same by the package's ordinary, checked constructors."""
    w = {name: 10.0 ** float(value) for name, value in logs.items()}
    if controller == "lqg":
        # What tuning has found is shown even if it runs away in the end.
        return LQG.design(
            benchmark, e=(w["e1"], w["e2"]), r=(1.0, w["r2"]), y=(w["y1"], w["y2"]), q=w["q"],
            allow_unstable=True,
        )  # fmt: skip
    return ADFC(pull=w["pull"], towards="inverse", q=w["q"])
