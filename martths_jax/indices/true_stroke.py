"""J2 and J3 of the true strokes: what the actuators did, without what the sensors added.

With the benchmark's noise much of J2 is noise: 3.12 and 1.63 % of the strokes that the reference
structure asks actuators 1 and 2 for (mean of the three records at a scale of 0.40), and 3.41 and
1.74 % of those that the loop asks for under ADFC, which are smaller; its J2 is published as 3.9 and
2.46 %.  Rms values add as squares: J2^2 = J2true^2 + floor^2, but for what noise and error have in
common.
"""

from __future__ import annotations

from collections.abc import Sequence

from martths_jax.indices.base import Index, Pair, plain
from martths_jax.indices.benchmark import ACTUATORS
from martths_jax.indices.peak import Peak
from martths_jax.indices.rms import Rms


def indices_for(actuators: Sequence[str]) -> tuple[Index, ...]:
    """Those of actuators with these names."""
    return tuple(
        Index(
            f"{group}true_{plain(place)}", "%", kind, Pair.of("x", "x_a", row),
            f"{words} of the true stroke {place}, without sensor noise",
            "J2, J3 of Condori Uribe et al. 2023 on the plant's output",
        )
        for group, kind, words in (("J2", Rms(), "rms error"), ("J3", Peak(), "peak error"))
        for row, place in enumerate(actuators)
    )  # fmt: skip


INDICES = indices_for(ACTUATORS)
