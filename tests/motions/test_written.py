"""Files as people have them: each read right, refused with a remedy, or marked by a notice."""

import tempfile
import time
import warnings
from pathlib import Path

import h5py
import numpy as np
import psutil
import pytest
from scipy.io import savemat

from martths_jax.errors import InputError
from martths_jax.motions import load_motion, load_record
from martths_jax.motions.units import G

DT = 0.005
N = 400
TIME = np.arange(N) * DT
WAVE = 0.287668 * np.sin(2 * np.pi * 2 * TIME) * np.hanning(N) / 0.99  # [g]
WAVE = np.round(WAVE, 6)


@pytest.fixture
def write(tmp_path):
    def put(text, name="a.csv", encoding="utf-8"):
        path = tmp_path / name
        path.write_bytes(text.encode(encoding) if isinstance(text, str) else text)
        return path

    return put


def rows(*columns, separator=",", digits=6):
    return "\n".join(
        separator.join(f"{v:.{digits}f}" for v in r) for r in zip(*columns, strict=True)
    )


def check(path, values=WAVE * G, step=DT, notice=None, **options):
    record = load_record(path, **options)
    np.testing.assert_allclose(record.acceleration, values, rtol=1e-9, atol=1e-12)
    assert record.dt == pytest.approx(step, rel=1e-9)
    if notice is None:
        assert record.notices == ()
    else:
        assert any(notice in one for one in record.notices), record.notices


def refused(words, path, **options):
    with pytest.raises(InputError) as caught:
        load_record(path, **options)
    for word in words:
        assert word in str(caught.value), f"{word!r} is missing in: {caught.value}"


# ---- headers


@pytest.mark.parametrize(
    ("header", "options", "word"),
    [
        ("# Acceleration [g]\n# PGA = 294.2 [cm/s2]\n", {}, None),
        ("# PGA [cm/s2] = 294.2\nacc [g]\n", {}, None),
        ("Imaginary Valley (1/2/1999)\nAcceleration\n", {"units": "g"}, None),
        ("Lakeside Community Hall\n", {"units": "g"}, None),
        ("# The units are (g)\n", {}, None),
        ("Station (G)\n", {}, "brackets in line 1"),
        ("acc [mg]\n", {"units": "g"}, "unknown unit 'mg'"),
        ("displacement [mm]\n", {"units": "g"}, "'mm'"),
        ("velocity [cm/s]\n", {"units": "cm/s2"}, "'cm/s'"),
        ("acc [g]\n# UNITS OF CM/S2\n", {}, "two units"),
        ("Acceleration (g)\n", {"units": "m/s2"}, "`units` (--units) says m/s2"),
        ("acc [thousandths of g]\n", {"units": "g"}, "unknown unit"),
        ("acc [g]\n# dt = 0.01\n", {"dt": DT}, "time step"),
        ("acc [g]\n# dt = 0.01 s\n# fs = 200 Hz\n", {}, "two time steps"),
        ("acc [g]\n# NPTS = 500\n", {}, "500 samples"),
        ("acc [g]\n# dt = 5 furlongs\n", {}, None),
        ("acc [g]\n# scale factor = 0.001\n", {}, "scale factor 0.001 was not applied"),
    ],
)
def test_header(write, header, options, word):
    path = write(header + rows(WAVE))
    options = options if "dt" in header else {"dt": DT} | options
    if word and ("brackets" in word or "applied" in word):
        check(path, notice=word, **options)
    elif word:
        refused([str(path), word], path, **options)
    elif "furlongs" in header:
        check(path, step=5.0, notice="ms", **options)
    else:
        check(path, **options)


def test_header_with_blanks_for_tabs(write):
    path = write("Time (s)   Acceleration (g)\n" + rows(TIME, WAVE, separator=" "), "a.txt")
    check(path)
    refused(["its unit is g"], path, units="m/s2")
    check(write("Time (sec) Ground Acceleration (g)\n" + rows(TIME, WAVE, separator="  ")))


@pytest.mark.parametrize("unit", ["ms", "min", "s"])
def test_time_in_other_units(write, unit):
    factor = {"ms": 1e3, "min": 1 / 60, "s": 1.0}[unit]
    text = "\n".join(f"{t * factor:.7f},{a:.6f}" for t, a in zip(TIME, WAVE, strict=True))
    check(write(f"time [{unit}],acc [g]\n{text}"))
    refused(["found the time in 'm'", "`dt` (--dt)"], write(f"time [m],acc [g]\n{text}"))


@pytest.mark.parametrize(
    "said",
    ["dt = 0.005", "dt=5 ms", "dt [ms]: 5", "time step = 0.005 s", "Time step (s): 0.005",
     "dt 0.005", "fs = 200 Hz", "sampling rate: 200", "Sampling Frequency (Hz) = 200", "dt = 0,005",
     "NPTS=   400, DT=   .0050 SEC,", "  400    0.0050    NPTS, DT",
     "sampling interval is 0.005 sec", "number of points: 400, dt = .5D-2"],
)  # fmt: skip
def test_steps_in_headers(write, said):
    check(write(f"# {said}\nacc [g]\n" + rows(WAVE)))
    refused(["`dt` (--dt) says 0.01 s"], write(f"# {said}\nacc [g]\n" + rows(WAVE)), dt=0.01)


@pytest.mark.parametrize(
    "title",
    ["acc [g]", "acc (g)", "acc in g", "acc, g", "acc_g", "a/g", "Beschleunigung / g", "acc g",
     "NS [g]", "Acceleration (NS) [g]", "Acceleration, units: g", "# UNITS OF G\nacc",
     "# units: s, g\nacc", "# The units are (g)\nacc", "# acceleration in g\nvalue", "acc\ng",
     "# Acceleration (g)\n# more", "# acc [g]\n# Vs30 = 300 m/s\nSite (B)",
     "# PGA = 0.3 (m/s2)\nacc [g]"],
)  # fmt: skip
def test_where_a_unit_may_stand(write, title):
    check(write(title + "\n" + rows(WAVE)), dt=DT)
    refused(["its unit is g"], write(title + "\n" + rows(WAVE)), dt=DT, units="cm/s2")


@pytest.mark.parametrize(
    "title",
    ["acc_V", "acc (N)", "Event (1/2/1999)", "PGA = 294.2 [cm/s2]", "# Level 0.3 (g)\nWest wall"],
)
def test_what_is_no_unit(write, title):
    path = write(title + "\n" + rows(WAVE))
    refused(["does not say the unit"], path, dt=DT)
    check(path, units="g", dt=DT)


def test_rows_that_are_counted(write):
    for first in (0, 1):
        text = rows(np.arange(N) + first, WAVE)
        check(write("sample,acc [g]\n" + text), dt=DT)
        check(write("no,acc [g]\n# dt = 0.005\n" + text))
        check(write("x,acc [g]\n" + text), dt=DT)
        check(write("t,acc [g]\n" + text), step=1.0, notice="count rows")
        refused(["`dt` (--dt) says"], write("t [s],acc [g]\n" + text), dt=DT)


# ---- numbers


@pytest.mark.parametrize(("rate", "digits"), [(256, 3), (1024, 4), (400, 3), (128, 3)])
def test_times_with_few_decimals(write, rate, digits):
    text = "\n".join(f"{k / rate:.{digits}f},{a:.6f}" for k, a in enumerate(WAVE))
    path = write("t,a [g]\n" + text)
    check(path, step=1 / rate)
    assert load_record(path).dt == 1 / rate
    gap = text.splitlines()
    refused(["uniform step"], write("t,a [g]\n" + "\n".join(gap[:150] + gap[151:])))


def test_times_with_too_few_decimals_need_the_step(write):
    text = "\n".join(f"{k / 1024:.3f},{a:.6f}" for k, a in enumerate(WAVE))
    path = write("t,a [g]\n" + text)
    refused(["too few decimals (3)", "`dt` (--dt"], path)
    assert load_record(path, dt=1 / 1024).dt == 1 / 1024


def test_decimal_comma(write):
    text = rows(TIME, WAVE)
    comma = "\n".join(";".join(line.split(",")).replace(".", ",") for line in text.splitlines())
    check(write("Zeit [s];Beschleunigung [g]\n" + comma))
    check(write("t a_g\n" + comma.replace(";", " "), "a.txt"))
    check(write(rows(WAVE).replace(".", ",")), units="g", dt=DT)
    refused(["decimal comma"], write("1,25\n2,75\n3,5\n"), units="g", dt=DT)
    refused(["decimal comma"], write("0.5;1,234\n1.0;2,345\n"), units="g", dt=DT)


def test_spreadsheets(write):
    text = rows(TIME, WAVE * G)
    values = np.round(WAVE * G, 6)
    check(write("Time [s],Acceleration [m/s²]\n" + text, encoding="cp1252"), values=values)
    quoted = "\n".join(",".join(f'"{c}"' for c in line.split(",")) for line in text.splitlines())
    check(write('"Time [s]","Acc [m/s2]"\n' + quoted), values=values)
    check(write("Time [s],Acc [m/s2],\n" + text.replace("\n", ",\n") + ","), values=values)


def test_counts_above_the_samples(write):
    check(write(f"{N}\n0.005\n" + rows(WAVE)), units="g", notice="number of samples (400)")
    check(write(f"{N} 0.005\n" + rows(WAVE)), units="g", notice="time step (0.005 s)")
    refused(["may be a count or a sample"], write("397\n" + rows(WAVE)), units="g", dt=DT)
    record = load_record(write("0.005\n" + rows(WAVE)), units="g", dt=DT)
    assert any("is the time step" in notice for notice in record.notices)


def test_first_rows_are_not_swallowed_as_header(write):
    lines = rows(TIME, WAVE).splitlines()
    for broken in ("0.000,", "0.000,n/a", "0.000,1.2.3", "2020-01-01"):
        refused(["line 1"], write("\n".join([broken, *lines[1:]])), units="g")
        refused(["line 2"], write("\n".join(["t,a", broken, *lines[1:]])), units="g")


def test_one_long_line_takes_time_in_proportion(write):
    def seconds(count):
        path = write(",".join(["0.5", "0.25"] * (count // 2)))
        start = time.process_time()
        assert load_record(path, units="g", dt=DT).acceleration.size == count
        return time.process_time() - start

    seconds(1000)
    assert seconds(80_000) < 16 * max(seconds(20_000), 0.01)


# ---- columns


def test_three_components(write):
    path = write(
        "Time [s],NS [g],EW [g],UD [g]\n" + rows(TIME, WAVE, 0.5 * WAVE, 0.3 * WAVE, digits=9)
    )
    for variable, factor in ("NS", 1.0), ("n-s", 1.0), ("EW", 0.5), (4, 0.3), ("3", 0.5):
        check(path, values=factor * WAVE * G, variable=variable)
    refused(["2 (NS), 3 (EW), 4 (UD)", "`variable` (--variable)"], path)
    refused(["is the time"], path, variable=1)
    refused(["no column 'XX'", "2 (NS)"], path, variable="XX")


def test_the_only_acceleration_is_taken(write):
    text = "t [s],vel [cm/s],acc [g],disp [cm]\n" + rows(TIME, TIME**2, WAVE, TIME**3)
    check(write(text))
    refused(["unknown unit 'cm/s'"], write(text), variable="vel")
    for title in ("T (s),Sa (g)", "Period (s),PSA [g]", "T,spectral acceleration [g]"):
        refused(["history"], write(f"{title}\n" + rows(TIME + DT, np.abs(WAVE))), dt=DT)


def test_damaged_times_without_titles(write):
    for times in (TIME[::-1], np.r_[TIME[:50], TIME[51:], TIME[-1] + DT]):
        refused(["uniform step"], write(rows(times, WAVE)), units="g")


def test_several_values_a_line(write):
    lines = ["".join(f"{v:15.7E}" for v in WAVE[k : k + 5]) for k in range(0, N, 5)]
    record = load_record(write("\n".join(lines), "a.dat"), units="g", dt=DT)
    np.testing.assert_allclose(record.acceleration, WAVE * G, atol=1e-6)
    assert any("row by row" in notice for notice in record.notices)
    three = rows(WAVE, np.roll(WAVE, 40), -WAVE, separator=" ")
    refused(["3 columns", "1, 2, 3"], write(three, "b.dat"), units="g", dt=DT)
    check(write(three, "b.dat"), units="g", variable=3, values=-WAVE * G, dt=DT)


# ---- arrays


@pytest.mark.parametrize("shape", ["2xN", "Nx2", "swapped"])
@pytest.mark.parametrize("form", ["array", "npy", "csv", "mat", "list"])
def test_two_by_n_in_every_form(write, tmp_path, shape, form):
    pair = np.stack([TIME, WAVE])
    array = {"2xN": pair, "Nx2": pair.T, "swapped": pair[::-1].T}[shape]
    given = array
    if form == "npy":
        given = tmp_path / "a.npy"
        np.save(given, array)
    elif form == "csv":
        given = write("\n".join(",".join(f"{v:.6f}" for v in row) for row in array))
    elif form == "mat":
        given = tmp_path / "a.mat"
        savemat(given, {"A": array})
    elif form == "list":
        given = array.tolist()
    check(given, units="g")
    if form != "csv":
        assert load_motion(given, units="g", scale=1.0).acceleration.size > N


def test_other_arrays(tmp_path):
    check(WAVE, units="g", dt=DT)
    many = np.stack([TIME, WAVE, 0.5 * WAVE, 0.2 * WAVE])
    check(many, units="g", variable=3, values=0.5 * WAVE * G)
    refused(["4 columns", "2, 3, 4", "`variable`"], many, units="g")
    for bad in (np.zeros((3, 4, 5)), np.array(["a", "b"]), [[1, 2], [3]], np.empty(0)):
        refused(["rray"], bad, units="g", dt=DT)
    np.save(tmp_path / "o.npy", np.array([{}], dtype=object), allow_pickle=True)
    refused(["cannot be read as a NumPy array"], tmp_path / "o.npy", units="g")
    for bad in (None, 3, b"x"):
        refused(["`path_or_name`", "array"], bad)


# ---- formats told by content


def test_renamed_files(write, tmp_path):
    lines = ["".join(f"{v:15.7E}" for v in WAVE[k : k + 5]) for k in range(0, N, 5)]
    head = ["PEER NGA RECORD", "Somewhere 1/1/1999", "ACCELERATION TIME SERIES IN UNITS OF G"]
    text = "\n".join([*head, f"NPTS= {N}, DT= .0050 SEC", *lines, "*** End of record ***"])
    for name in ("a.AT2", "a.txt", "a.csv", "a.dat"):
        record = load_record(write(text, name))
        np.testing.assert_allclose(record.acceleration, WAVE * G, atol=1e-6)
    refused(["NPTS= ..., DT= ..."], write("t,a [g]\n" + rows(TIME, WAVE), "b.AT2"))
    savemat(tmp_path / "m.mat", {"A": np.stack([TIME, WAVE])})
    check(write((tmp_path / "m.mat").read_bytes(), "m.csv"), units="g")
    check(write(rows(TIME, WAVE, separator="  "), "ascii.mat"), units="g")


# ---- MATLAB


def test_simulink_structure_with_time(tmp_path):
    signals = {"values": WAVE[:, None], "dimensions": 1.0, "label": "acc"}
    out = {"time": TIME[:, None], "signals": signals, "blockName": "model/To Workspace"}
    savemat(tmp_path / "s.mat", {"simout": out, "tout": TIME})
    check(tmp_path / "s.mat", units="g")
    signals["values"] = np.column_stack([WAVE, 0.5 * WAVE])
    savemat(tmp_path / "two.mat", {"simout": out})
    path = tmp_path / "two.mat"
    check(path, units="g", variable="simout.signals.values:2", values=0.5 * WAVE * G)
    refused(["2 columns", "1, 2"], path, units="g", variable="simout.signals.values")


def test_units_beside_the_array(tmp_path):
    savemat(tmp_path / "u.mat", {"rec": {"acc": WAVE, "dt": DT, "units": "g"}})
    check(tmp_path / "u.mat", variable="rec.acc")
    refused(["its unit is g"], tmp_path / "u.mat", variable="rec.acc", units="m/s2")


def test_timeseries_objects_are_refused_with_what_to_do(tmp_path):
    with h5py.File(tmp_path / "ts.mat", "w", userblock_size=512) as file:
        item = file.create_dataset("ts", data=np.arange(6, dtype=np.uint32)[None])
        item.attrs["MATLAB_class"] = np.bytes_("timeseries")
        item.attrs["MATLAB_object_decode"] = 3
    refused(["ts (timeseries)", "acc = ts.Data"], tmp_path / "ts.mat", units="g", dt=DT)


def test_memory_counts_all_arrays_and_sees_into_cells(tmp_path, monkeypatch):
    class Little:
        available = 100_000_000

    monkeypatch.setattr(psutil, "virtual_memory", Little)
    with h5py.File(tmp_path / "many.mat", "w") as file:
        for k in range(10):
            file.create_dataset(f"a{k}", (2, 100_000), "f4", chunks=(2, 1000), fillvalue=1.0)
    refused(["GiB", "all that it holds"], tmp_path / "many.mat", units="g", variable="a0")
    cell = np.empty((1, 1), dtype=object)
    cell[0, 0] = np.zeros(2_000_000)
    savemat(tmp_path / "cell.mat", {"c": cell, "M": np.stack([TIME, WAVE])}, do_compression=True)
    assert (tmp_path / "cell.mat").stat().st_size < 50_000
    refused(["GiB", "all that it holds"], tmp_path / "cell.mat", units="g", variable="M")


@pytest.mark.parametrize("kind", ["external", "virtual"])
def test_numbers_in_other_files_are_not_read(tmp_path, kind):
    other = tmp_path / "secret"
    other.write_bytes(bytes(range(200)))
    with h5py.File(tmp_path / "x.mat", "w") as file:
        if kind == "external":
            file.create_dataset("acc", (1, 200), "u1", external=[(str(other), 0, 200)])
        else:
            layout = h5py.VirtualLayout(shape=(1, 200), dtype="f8")
            layout[:] = h5py.VirtualSource(tmp_path / "other.h5", "a", shape=(1, 200))
            file.create_virtual_dataset("acc", layout)
        file["dt"] = 0.01
    refused(["`acc`", "another file"], tmp_path / "x.mat", units="g")


# ---- plausibility


@pytest.mark.parametrize(
    ("factor", "dt", "units", "word"),
    [
        (980.0, DT, "g", "likely in cm/s2 or m/s2"),
        (980.0, DT, "m/s2", "likely in cm/s2"),
        (1e-4, DT, "g", "too little"),
        (0.005, DT, "m/s2", None),
        (0.002, DT, "m/s2", "likely in g"),
        (1.0, 5.0, "g", "likely in ms"),
        (1.0, 1.0, "g", "count rows"),
    ],
)
def test_notices(factor, dt, units, word):
    record = load_record(WAVE * factor, dt=dt, units=units)
    assert (word is None and not record.notices) or any(word in n for n in record.notices)


def test_nothing_warns(write):
    with warnings.catch_warnings(), tempfile.TemporaryDirectory() as folder:
        warnings.simplefilter("error")
        path = Path(folder) / "w.csv"
        path.write_text("1e400,1\n0,2\n")
        refused([str(path)], path, units="g")
