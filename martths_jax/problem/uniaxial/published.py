"""What is printed of the uniaxial benchmark: its sample controller and nominal plant (Table 3)."""

from __future__ import annotations

from martths_jax.published import Published

#: Case -> J1 [ms], J2 ... J9 [%].
_ROWS = {
    1: (4.6, 10.4, 11.5, 36.1, 19.0, 32.3, 32.4, 14.8, 14.8),
    2: (4.6, 9.8, 11.1, 33.1, 17.1, 30.5, 30.5, 15.3, 15.2),
    3: (4.6, 9.1, 10.2, 49.9, 36.7, 49.8, 49.8, 35.5, 35.6),
    4: (4.6, 10.5, 11.3, 72.6, 35.2, 68.5, 68.7, 33.4, 33.3),
}
#: By case.
TABLE3 = {
    case: Published(
        table="Table 3",
        records=("El Centro",),
        scale=0.40,
        values={"pi-lead": {f"J{i}": value for i, value in enumerate(row, 1)}},
    )
    for case, row in _ROWS.items()
}
