"""Formats of the big archives, in files made here after their published layouts.

Headers are those of real records as far as the numbers go (station, step, scale factor, peak); the
samples are made here, with the stated peak.
"""

import numpy as np
import pytest

from martths_jax.errors import InputError
from martths_jax.motions import load_record
from martths_jax.motions.units import G

SAMPLES = 203


def wave(peak: float, samples: int = SAMPLES, decimals: int = 5) -> np.ndarray:
    """(n,) a motion whose largest magnitude is exactly `peak`, signed."""
    time = np.linspace(0, 4, samples)
    values = np.sin(2 * np.pi * 1.3 * time) * np.hanning(samples)
    at = np.argmax(np.abs(values))
    return np.round(values * peak / values[at], decimals)


def lines_of(values, width: int, decimals: int, columns: int) -> list[str]:
    """Fixed columns, as Fortran prints them."""
    texts = [f"{v:{width}.{decimals}f}" for v in values]
    return ["".join(texts[k : k + columns]) for k in range(0, len(texts), columns)]


def write(folder, name: str, lines, encoding: str = "utf-8"):
    path = folder / name
    path.write_text("\n".join(lines) + "\n", encoding=encoding)
    return path


def refused(words, path, **options):
    with pytest.raises(InputError) as caught:
        load_record(path, **options)
    for word in [str(path), *words]:
        assert word in str(caught.value), f"{word!r} is missing in: {caught.value}"


# ---- CSMIP, Volume 2: Fortuna, 20 December 2022, channel 1: 0.010 s, peak -388.166 cm/s^2


def csmip(channels, unit: str = "cm/sec2") -> list[str]:
    lines = []
    for number, (direction, values) in enumerate(channels, 1):
        peak = values[np.argmax(np.abs(values))]
        lines += [
            f"Corrected accelerogram   89486-N2628-22354.08   Chan  {number}: {direction}     from",
            "Uncorrected Accelerogram Data             Processed: 12/20/22, CGS  ce89486h",
            "Station No. 89486   40.585N, 124.146W    Etna2   s/n 2628  (3 Chns of  3 at Sta)",
            f"Chan  {number}: {direction}",
            "Instr Period =  .0049 sec,  Damping =  .700,  Sensitivity =  .63 v/g",
            f" {values.size} points of instrument- and baseline-corrected accel, veloc and displ",
            "At equally-spaced intervals of   0.010  sec.",
            f"Peak acceleration = {peak:9.3f}    cm/sec/sec  at   35.020   sec.",
            "Peak   velocity   =    34.735      cm/sec    at   34.810   sec.",
            "    1  100    1    3    3  200    1    3    1   24   22 2628    089486   21    0",
            " 0.0049020 0.7000000 101.00000 0.0245240 1.0000000 625.00000-0.4021815 35.014999",
            f" {values.size} points of accel data equally spaced at 0.010 sec, in {unit}. (8f10.5)",
            *lines_of(values, 10, 5, 8),
            f" {values.size} points of veloc data equally spaced at 0.010 sec, in cm/sec. (8f10.5)",
            *lines_of(0.1 * values, 10, 5, 8),
            f"/&  ----------  End of data for channel  {number}  ----------",
        ]
    return lines


def test_csmip_volume_2(tmp_path):
    values = wave(-388.16556)
    path = write(tmp_path, "ce89486.v2", csmip([("180 Deg", values)]))
    record = load_record(path)
    assert record.dt == 0.01 and record.notices == ()
    np.testing.assert_allclose(record.acceleration, 0.01 * values)
    assert record.pga == pytest.approx(3.88166, abs=1e-5)


def test_csmip_channels_by_direction_and_number(tmp_path):
    three = [("180 Deg", wave(-388.16556)), ("Up", wave(95.5)), ("90 Deg", wave(301.25))]
    path = write(tmp_path, "three.txt", csmip(three))  # told by its content
    for variable, values in ("Up", three[1][1]), ("90 Deg", three[2][1]), ("1", three[0][1]):
        found = load_record(path, variable=variable).acceleration
        np.testing.assert_allclose(found, 0.01 * values)
    refused(["3 channels", "1 (180 Deg), 2 (Up), 3 (90 Deg)", "--variable"], path)
    refused(["no channel 'EW'"], path, variable="EW")


def test_csmip_that_contradicts_itself(tmp_path):
    lines = csmip([("Up", wave(80.0))])
    refused(["truncated"], write(tmp_path, "cut.v2", lines[:20]))
    other = [line.replace("80.000    cm", "95.000    cm") for line in lines]
    refused(["peak is 95", "reach 80"], write(tmp_path, "peak.v2", other))
    refused(["`units` (--units) says g"], write(tmp_path, "g.v2", lines), units="g")
    raw = [line for line in lines if "points of" not in line]
    refused(["Volume 2"], write(tmp_path, "raw.v2", raw))
    refused(["not those of a CSMIP file"], write(tmp_path, "other.v2", ["t,a [g]", "0,1", "1,2"]))


# ---- COSMOS 1.20: Bremner River, 30 November 2018: 5 ms, peak -6.8515 cm/s^2


def cosmos(values, step_ms: float = 5.0, unit: str = "cm/sec2(04)", first="Corrected") -> list[str]:
    reals = np.full(100, -999.0)
    reals[61], reals[62] = step_ms, values.size * step_ms / 1000
    reals[63], reals[64] = values[np.argmax(np.abs(values))], 76.215
    return [
        f"{first} acceleration    (Format v01.20 with 13 text lines)",
        "Record of Point MacKenzie Earthquake of Fri Nov 30, 2018 17:29 UTC",
        "Statn No: 37-000011 Code:AK-BMR     UAF  Bremner River, AK, USA",
        "Sta Chan   ?:Up (Rcrdr Chan  ?) Location:",
        " 100 Integer-header values follow on  10 lines, Format= (10I8)",
        *lines_of(np.full(100, -999), 8, 0, 10),
        " 100 Real-header values follow on  20 lines, Format= (5F15.6)",
        *lines_of(reals, 15, 6, 5),
        '   1 Comment line(s) follow, each starting with a "|":',
        "| Sensor: KINEMETRICS EPISENSOR ES-T",
        f"   {values.size} acceleration pts, approx  210 secs, units={unit},Format=(1E15.6)",
        *[f"{v:15.6e}" for v in values],
        "End-of-data for Chan  ? acceleration",
    ]


def test_cosmos(tmp_path):
    values = wave(-6.851512, decimals=6)
    record = load_record(write(tmp_path, "bmr.V2c", cosmos(values)))
    assert record.dt == 0.005
    np.testing.assert_allclose(record.acceleration, 0.01 * values)
    in_g = load_record(write(tmp_path, "g.V2c", cosmos(values / 981, unit="g(02)")))
    np.testing.assert_allclose(in_g.acceleration, G * values / 981, atol=1e-7)
    raw = write(tmp_path, "v1.v1c", cosmos(values, first="Uncorrected"))
    assert any("uncorrected" in notice for notice in load_record(raw).notices)


def test_cosmos_that_contradicts_itself(tmp_path):
    values = wave(-6.851512, decimals=6)
    refused(["time step", "0 ms"], write(tmp_path, "dt.v2c", cosmos(values, step_ms=0.0)))
    lines = cosmos(values)
    refused(["truncated"], write(tmp_path, "cut.v2c", lines[:100]))
    counts = [line.replace("Corrected acceleration", "Raw acceleration counts") for line in lines]
    refused(["corrected acceleration"], write(tmp_path, "raw.v0c", counts))


# ---- SMC: San Francisco, 1295 Shafter, 18 October 1989: 200 Hz, peak 104.4078 cm/s^2


def smc(values, first: str = "2 CORRECTED ACCELEROGRAM", rate: float = 200.0, comments: int = 2):
    integers = np.full(48, -32768)
    integers[15], integers[16] = comments, values.size
    reals = np.full(50, 1.7e38)
    reals[1], reals[28], reals[29] = rate, 10.17, values.max()
    reals[30], reals[31] = 10.34, values.min()
    texts = [first, "*", "SAF0A", "     1989  10  18    0004 Loma Prieta, CA"]
    texts += ["Moment Mag=      7.1", "station = San Francisco, 1295 Shafter, F component=    360"]
    return [
        *texts,
        *["*"] * 5,
        *lines_of(integers, 10, 0, 8),
        *["".join(f"{r:15.7E}" for r in reals[k : k + 5]) for k in range(0, 50, 5)],
        *["|ref - a report of 1989, in g"] * comments,
        *["".join(f"{v:10.3E}"[:10] for v in values[k : k + 8]) for k in range(0, values.size, 8)],
    ]


def test_smc(tmp_path):
    values = np.array([float(f"{v:.3E}") for v in wave(104.4)])
    record = load_record(write(tmp_path, "0111a.smc", smc(values)))
    assert record.dt == 0.005
    np.testing.assert_allclose(record.acceleration, 0.01 * values)
    assert record.pga == pytest.approx(1.044)
    renamed = load_record(write(tmp_path, "0111a.AT2", smc(values)))
    np.testing.assert_array_equal(renamed.acceleration, record.acceleration)


def test_smc_that_is_no_acceleration_or_damaged(tmp_path):
    values = np.array([float(f"{v:.3E}") for v in wave(104.4)])
    refused(["velocity history"], write(tmp_path, "v.smc", smc(values, "3 VELOCITY")))
    refused(["sampling rate"], write(tmp_path, "u.smc", smc(values, rate=1.7e38)))
    refused(["truncated"], write(tmp_path, "cut.smc", smc(values)[:-2]))


# ---- K-NET: MYG002, 18 January 2006, N-S: 100 Hz, 3920(gal)/6182761, peak 48.060 gal


def knet(counts, peak: float, scale: str = "3920(gal)/6182761", freq: int = 100) -> list[str]:
    head = {
        "Origin Time": "2006/01/18 23:25:00", "Lat.": "37.798", "Long.": "142.200",
        "Depth. (km)": "36", "Mag.": "5.7", "Station Code": "MYG002", "Station Lat.": "38.7262",
        "Station Long.": "141.5109", "Station Height(m)": "79",
        "Record Time": "2006/01/18 23:25:46", "Sampling Freq(Hz)": f"{freq}Hz",
        "Duration Time(s)": f"{counts.size / freq:g}", "Dir.": "N-S", "Scale Factor": scale,
        "Max. Acc. (gal)": f"{peak:.3f}", "Last Correction": "2006/01/18 23:25:31", "Memo.": "",
    }  # fmt: skip
    lines = [f"{name:18}{value}" for name, value in head.items()]
    return lines + lines_of(counts, 9, 0, 8)


@pytest.mark.parametrize("ending", [".NS", ".EW2", ".txt"])
def test_knet(tmp_path, ending):
    factor = 3920 / 6182761
    counts = np.round(8005 + wave(48.06, 200) / factor)
    gal = (counts - counts.mean()) * factor
    record = load_record(write(tmp_path, f"MYG002{ending}", knet(counts, np.abs(gal).max())))
    assert record.dt == 0.01
    np.testing.assert_allclose(record.acceleration, 0.01 * gal, atol=1e-12)
    assert record.pga == pytest.approx(0.4806, rel=1e-2)
    assert any("mean" in notice for notice in record.notices)


def test_knet_that_contradicts_itself(tmp_path):
    counts = np.round(8005 + wave(48.06, 200) * 1577.2)
    refused(["peak is 4.806"], write(tmp_path, "a.NS", knet(counts, 4.806)))
    refused(["truncated"], write(tmp_path, "b.NS", knet(counts, 48.06)[:-3]))
    refused(["scale factor"], write(tmp_path, "c.NS", knet(counts, 48.06, scale="")))


# ---- ESM: Argos, 28 July 2019, HNN: 0.005 s, peak 0.359017 cm/s^2 (AFAD's TADAS writes the same)


def esm(values, **changes) -> list[str]:
    head = {
        "EVENT_NAME": "GREECE", "EVENT_ID": "EMSC-20190728_0000106", "STATION_CODE": "ARS1",
        "STATION_NAME": "Town Hall,Argos,Argolis,Peloponnese", "VS30_M/S": "",
        "SAMPLING_INTERVAL_S": "0.005000", "NDATA": f"{values.size}", "STREAM": "HNN",
        "UNITS": "cm/s^2", "PGA_CM/S^2": f"{np.abs(values).max():.6f}", "TIME_PGA_S": "22.655000",
        "HEADER_FORMAT": "DYNA 1.2", "DATA_TYPE": "ACCELERATION", "USER1": "/home/x --le 0.1",
        "USER5": "",
    }  # fmt: skip
    head |= changes
    return [f"{name}: {value}" for name, value in head.items()] + [f"{v:.6f}" for v in values]


def test_esm(tmp_path):
    values = wave(0.359017, decimals=6)
    record = load_record(write(tmp_path, "HI.ARS1.ASC", esm(values)))
    assert record.dt == 0.005
    np.testing.assert_allclose(record.acceleration, 0.01 * values)
    renamed = load_record(write(tmp_path, "tadas.csv", esm(values)))
    np.testing.assert_array_equal(renamed.acceleration, record.acceleration)


def test_esm_that_contradicts_itself(tmp_path):
    values = wave(0.359017, decimals=6)
    refused(["velocity history"], write(tmp_path, "v.asc", esm(values, DATA_TYPE="VELOCITY")))
    refused(["unknown unit 'cm/s'"], write(tmp_path, "u.asc", esm(values, UNITS="cm/s")))
    refused(["peak is"], write(tmp_path, "p.asc", esm(values, UNITS="g")))
    refused(["NDATA = 500"], write(tmp_path, "n.asc", esm(values, NDATA="500")))


# ---- AFAD: Germencik, 20 July 2017: 0.01 s, raw peaks 13.200332, 12.163827, 9.840572 gal


def afad(columns, step: str = "0.01") -> list[str]:
    peaks = [np.abs(c).max() for c in columns]
    told = " ".join(f"({n}) {p:.6f}" for n, p in zip(("N-S", "E-W", "U-D"), peaks, strict=True))
    head = [
        "STRONG GROUND MOTION RECORDS OF TURKIYE",
        "PLACE                   : AYDıN GERMENCIK DEVLET HASTANESI",
        "EARTHQUAKE DATE         : 2017/07/20 22:31:09 (GMT)",
        "STATION COORDINATES     : 37.87470N-27.59223E",
        f"NUMBER OF DATA          : {columns[0].size}",
        f"SAMPLING INTERVAL (sec) : {step}",
        f"RAW PGA VALUES (gal)    : {told}",
        "Copyright EARTHQUAKE DEPARTMENT",
        "DISASTER AND EMERGENCY MANAGEMENT PRESIDENCY",
        "       N-S          E-W          U-D",
    ]
    return head + ["".join(f"{v:14.6f}" for v in row) for row in zip(*columns, strict=True)]


def test_afad(tmp_path):
    columns = [wave(13.200332), wave(-12.163827), wave(9.840572)]
    path = write(tmp_path, "20170720223109_0921.txt", afad(columns), "cp1254")
    for variable, values in ("NS", columns[0]), ("E-W", columns[1]), (3, columns[2]):
        record = load_record(path, variable=variable)
        assert record.dt == 0.01
        np.testing.assert_allclose(record.acceleration, 0.01 * values)
    refused(["1 (N-S), 2 (E-W), 3 (U-D)", "--variable"], path)
    lines = afad(columns)
    refused(["truncated"], write(tmp_path, "cut.txt", lines[:-9]), variable="NS")
    wrong = [line.replace("(N-S) 13.2", "(N-S) 0.0132") for line in lines]
    refused(["not in gal"], write(tmp_path, "g.txt", wrong), variable="NS")
