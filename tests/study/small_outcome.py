"""Results of a chunk with invented numbers, for tests of what is written and not of what is run."""

import numpy as np

from martths_jax.campaign.engine import Outcome
from martths_jax.indices import NAMES


def outcome(trials: int, seed: int = 0, **changes) -> Outcome:
    """`Outcome` of so many trials that all ended well; `changes` replace columns."""
    columns = {
        "value": 5 + np.random.default_rng(seed).random((trials, len(NAMES))),
        "status": np.zeros(trials, dtype=np.int32),
        "first": np.full((trials, 4, 2), np.nan),
        "volt_peak": np.ones((trials, 2)),
        "counts": {"held": np.zeros(trials, dtype=np.int32)},
        "names": NAMES,
    }
    return Outcome(**columns | changes)
