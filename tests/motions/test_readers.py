"""Every kind of file that is read, and every kind of bad file that is refused with a remedy."""

import h5py
import numpy as np
import psutil
import pytest
from scipy.io import savemat

from martths_jax.errors import InputError
from martths_jax.motions import load_motion, load_record
from martths_jax.motions.units import G

DT = 0.005
TIME = np.arange(400) * DT
WAVE = np.sin(2 * np.pi * 2 * TIME) * np.hanning(TIME.size)


def at2(tmp_path, values=WAVE, header="NPTS=  {n}, DT=   .0050 SEC,", unit="G", name="a.AT2"):
    lines = ["PEER NGA STRONG MOTION DATABASE RECORD", "Somewhere 1/1/1999, Station, 090"]
    lines += [f"ACCELERATION TIME SERIES IN UNITS OF {unit}", header.format(n=len(values))]
    for first in range(0, len(values), 5):
        lines.append("".join(f"{v:15.7E}" for v in values[first : first + 5]))
    path = tmp_path / name
    path.write_text("\n".join(lines) + "\n")
    return path


def table(tmp_path, text, name="a.csv"):
    path = tmp_path / name
    path.write_text(text)
    return path


def rows(*columns, separator=","):
    return "\n".join(separator.join(f"{v:.9g}" for v in row) for row in zip(*columns, strict=True))


# ---- what must be read


@pytest.mark.parametrize("transpose", [False, True])
def test_mat_table_both_ways_round(tmp_path, transpose):
    array = np.stack([TIME, WAVE])
    savemat(tmp_path / "m.mat", {"Motion": array.T if transpose else array})
    record = load_record(tmp_path / "m.mat", units="m/s2")
    assert record.dt == pytest.approx(DT)
    np.testing.assert_allclose(record.acceleration, WAVE)


@pytest.mark.parametrize("beside", [{"dt": DT}, {"t": TIME}, {"time": TIME[:, None]}])
def test_mat_struct_with_time_or_step(tmp_path, beside):
    savemat(tmp_path / "m.mat", {"rec": {"acc": WAVE, "note": "text", **beside}})
    record = load_record(tmp_path / "m.mat", units="g", variable="rec.acc")
    assert record.dt == pytest.approx(DT)
    np.testing.assert_allclose(record.acceleration, G * WAVE)


@pytest.mark.parametrize("inside", ["", "rec/"])
def test_mat_v73(tmp_path, inside):
    with h5py.File(tmp_path / "m.mat", "w", userblock_size=512) as file:
        file[f"{inside}Motion"] = np.stack([TIME, WAVE], axis=1)  # 2 x N in MATLAB
        name = file.create_dataset("note", data=np.array([[72], [105]], dtype=np.uint16))
        name.attrs["MATLAB_class"] = np.bytes_("char")
    record = load_record(tmp_path / "m.mat", units="cm/s2")
    np.testing.assert_allclose(record.acceleration, 0.01 * WAVE)


@pytest.mark.parametrize(
    "header", ["NPTS=  {n}, DT=   .0050 SEC,", "  {n}    0.0050    NPTS, DT", "NPTS={n},DT=0.005"]
)
def test_at2_headers_and_short_last_line(tmp_path, header):
    wave = WAVE[:398]  # the last line then has three values
    record = load_record(at2(tmp_path, wave, header))
    assert record.dt == pytest.approx(DT)
    np.testing.assert_allclose(record.acceleration, G * wave, atol=1e-7)


def test_at2_numbers_that_touch(tmp_path):
    path = at2(tmp_path, [0.1, -0.2, 0.3, -0.4, 0.5])
    path.write_text(path.read_text().replace("E-01 ", "E-01").replace(" -", "-"))
    assert "E-01-" in path.read_text()
    np.testing.assert_allclose(load_record(path).acceleration, G * np.array([1, -2, 3, -4, 5]) / 10)


@pytest.mark.parametrize(
    ("text", "units", "dt"),
    [
        ("time [s],acceleration [m/s^2]\n" + rows(TIME, WAVE), None, None),
        ("# El Centro (1940)\nt;a (g)\n" + rows(TIME, WAVE / G, separator=";"), None, None),
        ("t\ta\n" + rows(TIME, 100 * WAVE, separator="\t"), "cm/s2", None),
        ("a [gal]\n# dt = 0.005\n" + rows(100 * WAVE), None, None),
        (rows(WAVE), "m/s2", DT),
        ("\ufeffa\r\n" + rows(WAVE).replace("\n", "\r\n"), "m/s2", DT),
    ],
)
def test_tables(tmp_path, text, units, dt):
    record = load_record(table(tmp_path, text), units=units, dt=dt)
    assert record.dt == pytest.approx(DT)
    np.testing.assert_allclose(record.acceleration, WAVE, atol=1e-7)


def test_time_stamps_with_few_digits_are_uniform(tmp_path):
    time = np.arange(300) / 128
    text = "\n".join(f"{t:.4f},{np.sin(t):.6f}" for t in time)
    assert load_record(table(tmp_path, text), units="g").dt == pytest.approx(1 / 128, rel=1e-4)


# ---- what must be refused: file, place, what was found, remedy


def check_refused(words, *arguments, **options):
    with pytest.raises(InputError) as caught:
        load_motion(*arguments, **options)
    message = str(caught.value)
    for word in words:
        assert word in message, f"{word!r} is missing in: {message}"


def test_truncated_at2(tmp_path):
    path = at2(tmp_path)
    path.write_text("\n".join(path.read_text().splitlines()[:40]))
    check_refused([str(path), "line 4", "NPTS = 400", "180 values", "download it again"], path)


def test_npts_that_disagrees(tmp_path):
    path = at2(tmp_path, header="NPTS= 395, DT= .005 SEC")
    check_refused([str(path), "line 4", "NPTS = 395", "400 values", "correct NPTS"], path)


def test_at2_without_counts_and_of_velocity(tmp_path):
    check_refused(["a.AT2", "NPTS= ..., DT= ...", "save it as CSV"], at2(tmp_path, header="no"))
    path = at2(tmp_path)
    path.write_text(path.read_text().replace("ACCELERATION", "VELOCITY"))
    check_refused([str(path), "line 3", "velocity", ".AT2"], path)


@pytest.mark.parametrize("bad", ["nan", "inf"])
def test_not_a_number(tmp_path, bad):
    lines = rows(TIME, WAVE).splitlines()
    lines[6] = f"{TIME[6]},{bad}"
    path = table(tmp_path, "\n".join(lines))
    check_refused([str(path), "line 7", bad, "repair"], path, units="g")
    wave = WAVE.copy()
    wave[9] = float(bad)
    savemat(tmp_path / "m.mat", {"M": np.stack([TIME, wave])})
    check_refused(["m.mat", "`M`", "sample 10", bad], tmp_path / "m.mat", units="g")


def test_non_uniform_time(tmp_path):
    time = np.delete(TIME, 100)
    path = table(tmp_path, "t,a [g]\n" + rows(time, np.delete(WAVE, 100)))
    check_refused([str(path), "line 102", "0.505", "uniform"], path)
    backwards = TIME.copy()
    backwards[50] = backwards[48]
    savemat(tmp_path / "m.mat", {"M": np.stack([backwards, WAVE])})
    check_refused(["m.mat", "`M`", "sample 51", "0.24"], tmp_path / "m.mat", units="g")


def test_unknown_missing_and_contradicting_units(tmp_path):
    path = table(tmp_path, "t,a [ft/s2]\n" + rows(TIME, WAVE))
    check_refused([str(path), "line 1", "ft/s2", "g, m/s2, cm/s2"], path)
    path = table(tmp_path, rows(TIME, WAVE))
    check_refused([str(path), "does not say the unit", "--units"], path)
    check_refused(["units", "furlong", "g, m/s2, cm/s2"], path, units="furlong")
    path = at2(tmp_path)
    check_refused([str(path), "its unit is g", "`units` (--units) says m/s2"], path, units="m/s2")


def test_empty_things(tmp_path):
    check_refused(["empty.csv", "is empty"], table(tmp_path, "", "empty.csv"))
    check_refused(["header.csv", "no numbers"], table(tmp_path, "t,a\n", "header.csv"))
    savemat(tmp_path / "m.mat", {"Motion": np.empty((2, 0))})
    check_refused(["m.mat", "`Motion`", "empty", "--variable"], tmp_path / "m.mat", units="g")
    path = table(tmp_path, rows(TIME, 0 * WAVE))
    check_refused([str(path), "only zeros"], path, units="g")


def test_mat_without_the_right_variable(tmp_path):
    path = tmp_path / "m.mat"
    with h5py.File(path, "w") as file:
        file["K"] = np.eye(5)
    check_refused([str(path), "no array that could be a motion", "K (5 x 5)"], path, units="g")
    check_refused(
        [str(path), "no numeric array `Accel`", "K (5 x 5)"], path, units="g", variable="Accel"
    )
    savemat(path, {"A": np.stack([TIME, WAVE]), "B": np.stack([TIME, WAVE])})
    check_refused([str(path), "A, B", "--variable"], path, units="g")
    path.write_bytes(b"MATLAB 5.0 MAT-file" + bytes(200))
    check_refused([str(path), "cannot be read as a MATLAB file"], path, units="g")


def test_no_time_at_all(tmp_path):
    check_refused(["no time column", "--dt"], table(tmp_path, rows(WAVE)), units="g")


def test_ragged_and_wide_tables(tmp_path):
    path = table(tmp_path, rows(TIME, WAVE) + "\n1,2,3")
    check_refused([str(path), "line 401", "3 columns"], path, units="g")
    path = table(tmp_path, rows(TIME, WAVE, WAVE))
    check_refused([str(path), "3 columns", "2, 3", "`variable` (--variable)"], path, units="g")
    path = table(tmp_path, rows(TIME, WAVE) + "\nend of file")
    check_refused([str(path), "line 401", "end of file"], path, units="g")


def test_motion_longer_than_memory(tmp_path, monkeypatch):
    path = table(tmp_path, rows(1e9 * TIME, WAVE))
    check_refused(["a", str(path), "GiB", "time column"], path, units="g")

    class Little:
        available = 1000

    monkeypatch.setattr(psutil, "virtual_memory", Little)
    check_refused([str(path), "GiB"], path, units="g")


def test_unknown_names_and_endings(tmp_path):
    check_refused(["'nowhere'", "--records", "MARTHS_RECORDS"], "nowhere", records=tmp_path)
    check_refused(["--records", "missing"], "elcentro", records=tmp_path / "missing")
    path = table(tmp_path, rows(TIME, WAVE), "a.xlsx")
    check_refused([str(path), ".xlsx", ".csv"], path)
    table(tmp_path, rows(TIME, WAVE), "two.csv")
    table(tmp_path, rows(TIME, WAVE), "two.txt")
    check_refused(["two.csv, two.txt", "file name"], "TWO", records=tmp_path)
