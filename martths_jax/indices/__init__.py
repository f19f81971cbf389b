"""Evaluation indices: a table of names, and the kinds that they are of, one file each.

To add one, write a file like ``tracking.py``: a ``Kind`` if it needs a new one, and ``INDICES``;
and name it in ``table.GROUPS``.
"""

from martths_jax.indices.base import (
    REFERENCE,
    Index,
    Kind,
    Pair,
    Row,
    library,
    on_host,
    trials_first,
    trials_last,
)
from martths_jax.indices.benchmark import INDICES as BENCHMARK
from martths_jax.indices.benchmark import NAMES
from martths_jax.indices.delay import Delay, correlate
from martths_jax.indices.frequency import FrequencyEvaluation
from martths_jax.indices.norm import Norm
from martths_jax.indices.peak import Peak
from martths_jax.indices.rms import Rms
from martths_jax.indices.sums import (
    IndexSums,
    final_indices,
    indices,
    indices_of,
    join_sums,
    observers_of,
    without_value,
)
from martths_jax.indices.table import (
    DEFAULT,
    GROUPS,
    KNOWN,
    choose,
    files_of,
    groups_of,
    known_of,
)
from martths_jax.indices.tracking import TrackingIndicator

#: The benchmark's delays, and its pairs: name of the RMS index, name of the peak index.
DELAYS = tuple(i.name for i in BENCHMARK if isinstance(i.kind, Delay))
PAIRS = tuple(
    (rms.name, peak.name)
    for rms in BENCHMARK if rms.kind == Rms()
    for peak in BENCHMARK if peak.kind == Peak() and peak.pair == rms.pair
)  # fmt: skip

__all__ = [
    "BENCHMARK",
    "DEFAULT",
    "DELAYS",
    "GROUPS",
    "KNOWN",
    "NAMES",
    "PAIRS",
    "REFERENCE",
    "Delay",
    "FrequencyEvaluation",
    "Index",
    "IndexSums",
    "Kind",
    "Norm",
    "Pair",
    "Peak",
    "Rms",
    "Row",
    "TrackingIndicator",
    "choose",
    "correlate",
    "files_of",
    "final_indices",
    "groups_of",
    "indices",
    "indices_of",
    "join_sums",
    "known_of",
    "library",
    "observers_of",
    "on_host",
    "trials_first",
    "trials_last",
    "without_value",
]
