"""Random records and their files in every way of writing, for property tests."""

from dataclasses import dataclass

import numpy as np
from hypothesis import strategies as st

from martths_jax.motions.units import TO_SI

#: Ways to write each unit in a header.
SPELLINGS = {
    "g": ("g", "G", "g's"),
    "m/s2": ("m/s2", "m/s^2", "m/s²", "m/s/s", "m/sec^2", "m s-2", "M/S**2"),
    "cm/s2": ("cm/s2", "cm/s²", "cm/sec/sec", "gal", "Gal", "cm/s^2", "cm/sec2"),
}

#: Units of other quantities, or with a prefix: never those of the samples.
FOREIGN = ("mg", "mm/s2", "ft/s2", "cm/s", "mm", "g/10", "10^-3 g", "counts", "V", "milli-g")

#: Titles that hold what looks like a unit or a number, and say nothing of the samples.
TITLES = (
    "Imaginary Valley, 1/2/1999, Lakeside Community Hall, 090",
    "Imaginary Valley (1/2/1999)",
    "PGA = 294.2 [cm/s2]",
    "PGA (cm/s2): 294.2",
    "Peak value 0.3 (g)",
    "Vs30 = 300 m/s",
    "Unit 3 of the power plant (NS)",
    "Filter: 0.1 - 25 Hz, Station No. 24",
)


@dataclass(frozen=True)
class Written:
    """A file's content and what reading it right gives.

    Attributes:
        content, ending: the file.
        options: arguments that `load_record` needs.
        acceleration, dt: right values [m/s^2], [s].
        told: the unit that the header says, None where it says none.
    """

    content: bytes
    ending: str
    options: dict
    acceleration: np.ndarray
    dt: float
    told: str | None


def wave(seed: int, samples: int, dt: float) -> np.ndarray:
    """(n,) a smooth motion with a peak of 3 m/s^2."""
    draw = np.random.default_rng(seed)
    time = np.arange(samples) * dt
    tones = draw.uniform(1.0, 6.0, 4)
    phases = draw.uniform(0, 6, 4)
    values = np.sin(2 * np.pi * tones[:, None] * time + phases[:, None]).sum(axis=0)
    return 3.0 * values / np.abs(values).max()


@st.composite
def tables(draw, foreign: bool = False) -> Written:
    """A plain table in any unit, header, separator, decimal sign, encoding, order and format.

    With `foreign` the header names a unit that is none of the samples'.
    """
    dt = draw(st.sampled_from([0.005, 0.01, 0.02, 1 / 256, 1 / 128, 0.0025]))
    samples = draw(st.integers(40, 90))
    base = wave(draw(st.integers(0, 99)), samples, dt)
    unit = draw(st.sampled_from(sorted(TO_SI)))
    spelt = draw(st.sampled_from(FOREIGN if foreign else SPELLINGS[unit]))
    decimal = draw(st.sampled_from([".", ","]))
    separators = [";", "\t", "  "] if decimal == "," else [",", ";", "\t", "  ", ", "]
    separator = draw(st.sampled_from(separators))
    places = {"g": 7, "m/s2": 6, "cm/s2": 4}[unit]
    exponent = draw(st.booleans())
    number = (lambda v: f"{v:.7e}") if exponent else (lambda v: f"{v:.{places}f}")
    written = [number(v) for v in base / TO_SI[unit]]
    right = np.array([float(text) for text in written]) * TO_SI[unit]
    columns, names, options = [written], [("acc", spelt)], {}
    timed = draw(st.booleans())
    if timed:
        scale, name = draw(st.sampled_from([(1.0, "s"), (1.0, "sec"), (1e3, "ms")]))
        digits = (
            draw(st.sampled_from([3, 4, 6, 8])) if scale == 1.0 else draw(st.sampled_from([1, 4]))
        )
        columns.append([f"{k * dt * scale:.{digits}f}" for k in range(samples)])
        names.append((draw(st.sampled_from(["time", "Time", "t"])), name))
    if timed and draw(st.booleans()):
        columns.append([f"{v:.5f}" for v in np.cumsum(base) * dt])
        names.append((draw(st.sampled_from(["vel", "velocity"])), "cm/s"))
    if timed and draw(st.booleans()):
        columns.append([number(v) for v in 0.5 * base[::-1] / TO_SI[unit]])
        names.append(("acc2", spelt))
        options["variable"] = "acc"
    order = draw(st.permutations(range(len(columns))))
    if draw(st.booleans()) and "variable" in options:
        options["variable"] = order.index(0) + 1
    lines = [separator.join(columns[k][row] for k in order) for row in range(samples)]
    if decimal == ",":
        lines = [line.replace(".", ",") for line in lines]
    forms = ["[]", "()", "in", "row", "declared", "none"]
    form = draw(st.sampled_from(forms[:-1] if foreign else forms))
    if len(columns) > 2 and form in ("none", "declared"):
        form = "[]"
    if timed and names[1][1] == "ms" and form in ("none", "declared"):
        form = "()"
    header = [f"# {t}" for t in draw(st.lists(st.sampled_from(TITLES), max_size=2))]
    header += _titles(draw, form, [names[k] for k in order], separator, spelt)
    if not timed:
        how = draw(st.sampled_from(["dt", "header", "ms", "rate"]))
        stated = {"header": f"# dt = {dt!r}", "ms": f"# dt [ms]: {dt * 1e3!r}", "rate":
                  f"# sampling rate = {1 / dt!r} Hz"}  # fmt: skip
        header += [stated[how]] if how in stated else []
        options |= {"dt": dt} if how == "dt" else {}
    told = None if form == "none" else unit
    if told is None:
        options["units"] = unit
    newline = draw(st.sampled_from(["\n", "\r\n"]))
    text = newline.join([*header, *lines]) + draw(st.sampled_from(["", newline, newline * 2]))
    encoding = draw(st.sampled_from(["utf-8", "utf-8-sig", "cp1252", "utf-16"]))
    ending = draw(st.sampled_from([".csv", ".txt", ".dat"]))
    return Written(text.encode(encoding), ending, options, right, dt, told)


def _titles(draw, form: str, names: list, separator: str, spelt: str) -> list[str]:
    """Header lines that say the unit in one form."""
    comma = separator.strip() == ","
    if form == "none":
        return [separator.join(name for name, _ in names)] if draw(st.booleans()) else []
    if form == "declared":
        said = draw(
            st.sampled_from(["UNITS OF {}", "units: {}", "The units are ({})", "Unit = {}"])
        )
        return ["# acceleration, " + said.format(spelt)]
    if form == "row":
        if separator == "  " and any(" " in unit for _, unit in names):
            names = [(name, unit.replace(" ", ".")) for name, unit in names]
        return [separator.join(n for n, _ in names), separator.join(u for _, u in names)]
    pattern = {"[]": "{} [{}]", "()": "{} ({})", "in": "{} in {}"}[form]
    if form == "in" and separator == "  ":
        pattern = "{}_{}"
        # ``acc_V`` is a direction: only a longer word is a unit there.
        spelt = {"V": "volt"}
        names = [(name, spelt.get(unit, unit.replace(" ", "."))) for name, unit in names]
    titles = [pattern.format(name, unit) for name, unit in names]
    mark = draw(st.sampled_from(["", "# "]))
    if comma and draw(st.booleans()):
        titles = [f'"{title}"' for title in titles]
    return [mark + separator.join(titles)]


@st.composite
def running(draw) -> Written:
    """One series over rows of several values, as PEER and Fortran write it."""
    dt = draw(st.sampled_from([0.005, 0.01]))
    samples = draw(st.integers(90, 180))
    unit = draw(st.sampled_from(sorted(TO_SI)))
    wide = draw(st.integers(3, 8))
    base = wave(draw(st.integers(0, 99)), samples, dt)
    written = [f"{v:15.7E}" for v in base / TO_SI[unit]]
    right = np.array([float(text) for text in written]) * TO_SI[unit]
    lines = ["".join(written[k : k + wide]) for k in range(0, samples, wide)]
    spelt = draw(st.sampled_from(SPELLINGS[unit]))
    style = draw(st.sampled_from(["peer", "old", "plain", "counted"]))
    head = ["PEER NGA STRONG MOTION DATABASE RECORD", draw(st.sampled_from(TITLES))]
    head.append(
        draw(st.sampled_from(["ACCELERATION TIME SERIES IN UNITS OF {}", "ACCELERATION, UNITS ARE "
             "({})", "ACCELERATION TIME HISTORY IN UNITS OF {}. FILTER POINTS: HP=0.1 Hz LP=40. Hz"]
             )).format(spelt))  # fmt: skip
    ending = draw(st.sampled_from([".AT2", ".txt", ".dat", ".csv"]))
    options: dict = {}
    told = unit
    if style == "peer":
        head.append(f"NPTS=  {samples}, DT=   {dt:.4f} SEC,")
    elif style == "old":
        head.append(f"  {samples}    {dt:.4f}    NPTS, DT")
    else:
        ending = ".dat"
        head = [f"{samples}", f"{dt}"] if style == "counted" else []
        options = {"units": unit} | ({} if style == "counted" else {"dt": dt})
        told = None
    lines += draw(st.sampled_from([[], ["*** End of record ***"]])) if ending == ".AT2" else []
    return Written("\n".join([*head, *lines]).encode(), ending, options, right, dt, told)
