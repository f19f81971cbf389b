"""What the literature prints, for comparison only: nothing in the engine reads these numbers.

Table 1: Condori Uribe et al. 2023 (modes of the reference structure).  Table 4: Calayir, Tao &
Mercan 2025 (means over El Centro, Kobe and Morgan Hill scaled by 0.40, nominal plant).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Published:
    """Indices that a paper prints of a problem's nominal plant.

    Attributes:
        table: what the paper calls them.
        records: names of the ground motions that they are means over.
        scale: factor on these records [-].
        values: controller -> index -> number, in the index's unit.
        aside: what has a column of its own, which no controller here answers to: title -> index
            -> number.
    """

    table: str = ""
    records: tuple[str, ...] = ()
    scale: float = 1.0
    values: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    aside: Mapping[str, Mapping[str, float]] = field(default_factory=dict)

    def printed(self, index: str, controller: str) -> float | None:
        """What is printed of an index under a controller; None where nothing is."""
        return self.values.get(controller, {}).get(index)

    @property
    def over(self) -> str:
        """The records in words."""
        *most, last = self.records
        return f"{', '.join(most)} and {last}" if most else last

    @property
    def conditions(self) -> str:
        """What the numbers are over, to complete "... is"."""
        many = "records" if len(self.records) > 1 else "record"
        return f"over the {self.over} {many} at a scale of {self.scale:.2f}"


#: Of a problem without printed numbers.
NOTHING = Published()

#: Mode -> (natural frequency [Hz], effective mass in x [%]).
TABLE1 = {
    1: (2.2913, 81.05),
    2: (12.7480, 16.60),
    3: (26.2803, 5e-7),
    4: (26.5352, 0.009),
    5: (29.9124, 2.34),
}

#: Index -> (experiment with LQG, virtual LQG, virtual ADFC); J1 and J4 in ms, the rest in percent.
TABLE4 = {
    "J1_1": (-13.7, 2.0, 0.98),
    "J1_2": (2.9, 2.9, 0.98),
    "J2_1": (23.8, 4.8, 3.9),
    "J2_2": (13.2, 9.4, 2.46),
    "J3_1": (26.9, 5.3, 3.39),
    "J3_2": (13.7, 10.3, 2.92),
    "J4_1": (1.9, 1.9, 0.98),
    "J4_2": (4.9, 2.9, 0.98),
    "J5_4": (8.1, 6.7, 1.69),
    "J5_28": (27.8, 17.8, 2.59),
    "J6_4": (8.2, 7.4, 2.36),
    "J6_28": (28.6, 18.8, 3.88),
    "J7_4": (12.2, 10.6, 9.18),
    "J7_28": (26.2, 16.8, 7.13),
    "J8_2": (12.5, 1.8, 6.81),
    "J8_26": (12.7, 3.4, 6.15),
    "J8_3": (12.4, 2.1, 6.46),
    "J8_27": (12.5, 3.0, 6.2),
    "J9_4": (13.2, 11.9, 8.61),
    "J9_28": (27.3, 18.1, 7.02),
    "J10_2": (13.4, 2.7, 5.23),
    "J10_26": (13.4, 2.7, 4.59),
    "J10_3": (12.8, 1.8, 4.77),
    "J10_27": (13.2, 2.4, 4.61),
}
EXPERIMENT, LQG, ADFC = range(3)
#: Controllers by name -> their column of Table 4, and the one that the paper proposes.
COLUMNS = {"lqg": LQG, "adfc": ADFC}
COMPARED = tuple(COLUMNS)
PROPOSED = ("adfc",)
#: What runs on a problem of one's own if nothing is said: the paper's, beside no compensation.
ANYWHERE = ("adfc", "passthrough")
#: Who is compared with whom, trial by trial.
PAIR = ("adfc", "lqg")


_column = lambda i: {index: row[i] for index, row in TABLE4.items()}  # noqa: E731
#: The maRTHS benchmark's: Calayir, Tao & Mercan 2025.
MARTHS = Published(
    table="Table 4",
    records=("El Centro", "Kobe", "Morgan Hill"),
    scale=0.40,
    values={name: _column(i) for name, i in COLUMNS.items()},
    aside={"experiment (LQG)": _column(EXPERIMENT)},
)
