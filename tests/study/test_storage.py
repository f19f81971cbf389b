"""What is stored says whose it is: damage and mix-ups never give another number."""

import errno
import json
import os
import shutil

import numpy as np
import pytest
import xarray as xr
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from martths_jax import InputError
from martths_jax.campaign import machine, store
from martths_jax.campaign.dataset import read_dataset, write_dataset
from martths_jax.campaign.files import write_text
from martths_jax.campaign.parts import Damaged, Foreign, check_part, part_bytes, read_part
from martths_jax.study import Reporter, merge_runs, open_study, run_study
from tests.study.places import result_bytes, short_motion, small

TRIALS = 20


class Says(Reporter):
    """Keeps the notices."""

    def __init__(self):
        self.said = []

    def notice(self, text):
        self.said.append(text)


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    return run_study(small(tmp_path_factory.mktemp("whole")))


@pytest.fixture
def copy(whole, tmp_path):
    """The same study in a folder of the test's own."""
    return shutil.copytree(whole.folder, tmp_path / "run")


def again(folder, **changes):
    """Repeat the command; what it said."""
    says = Says()
    run_study(small(folder, **changes), reporter=says)
    return says.said


def flipped(content: bytes, bit: int) -> bytes:
    changed = bytearray(content)
    changed[bit // 8] ^= 1 << (bit % 8)
    return bytes(changed)


ABOUT = {"identity": "a", "controller": "lqg", "motion": "one", "first": 0, "last": 2,
         "machine": "m"}  # fmt: skip
COLUMNS = {"value": np.arange(6.0).reshape(3, 2), "status": np.arange(3, dtype=np.int32)}


def test_no_bit_of_a_part_changes_without_a_word(tmp_path):
    path, content = tmp_path / "part.npz", part_bytes(ABOUT, COLUMNS)
    path.write_bytes(content)
    about, columns = read_part(path)
    assert about == ABOUT | {"columns": {"value": ["<f8", [3, 2]], "status": ["<i4", [3]]}}
    assert all(np.array_equal(columns[k], v) for k, v in COLUMNS.items())
    for bit in range(0, 8 * len(content), 11):
        path.write_bytes(flipped(content, bit))
        with pytest.raises(Damaged):
            read_part(path)
    for length in (0, 10, len(content) - 1):
        path.write_bytes(content[:length])
        with pytest.raises(Damaged):
            read_part(path)


@pytest.mark.parametrize(
    ("key", "value"), [("identity", "b"), ("controller", "adfc"), ("motion", "two"), ("last", 3)]
)
def test_a_part_of_something_else_is_foreign(key, value):
    asked = {k: v for k, v in ABOUT.items() if k != "machine"}
    check_part(ABOUT, asked, {"m"})
    with pytest.raises(Foreign):
        check_part(ABOUT, asked | {key: value}, {"m"})
    with pytest.raises(Foreign, match="machine"):
        check_part(ABOUT, asked, {"n"})


def test_parts_in_the_wrong_place_are_computed_again(whole, copy):
    one, two = (copy / "parts" / "passthrough" / name for name in ("one", "two"))
    file = next(one.glob("*.npz")).name
    (one / file).rename(copy / "x")
    (two / file).rename(one / file)
    (copy / "x").rename(two / file)
    said = again(copy)
    assert sum("it is of motion" in text for text in said) == 2
    assert result_bytes(copy) == result_bytes(whole.folder)


def test_a_part_of_another_seed_is_not_taken(whole, copy, tmp_path):
    other = run_study(small(tmp_path / "other", seed=2))
    part = next((copy / "parts" / "passthrough" / "one").glob("*.npz"))
    shutil.copy(other.folder / part.relative_to(copy), part)
    assert any("of another study" in text for text in again(copy))
    assert result_bytes(copy) == result_bytes(whole.folder)


def test_run_json_heals_and_never_takes_other_parts(whole, copy, tmp_path):
    content = (copy / "run.json").read_bytes()
    bit = 8 * content.index(b'"seed": 1') + 8 * 8  # 1 becomes 0
    (copy / "run.json").write_bytes(flipped(content, bit))
    with pytest.raises(InputError, match=r"run\.json is damaged"):
        merge_runs(copy, signals=False)
    assert any("damaged" in text for text in again(copy))
    assert (copy / "run.json.damaged").read_bytes() == flipped(content, bit)
    assert result_bytes(copy) == result_bytes(whole.folder)
    (copy / "run.json").unlink()  # lost: what is there is still known by its parts
    again(copy)
    (copy / "run.json").write_bytes(b"{")
    with pytest.raises(InputError, match="what they are is unknown"):
        run_study(small(copy, seed=2))


@settings(max_examples=40, deadline=None, suppress_health_check=list(HealthCheck))
@given(where=st.floats(0, 1, exclude_max=True))
def test_no_bit_of_run_json_changes_without_a_word(whole, tmp_path, where):
    content = (whole.folder / "run.json").read_bytes()
    file = tmp_path / "run.json"
    file.write_bytes(flipped(content, int(where * 8 * len(content))))
    try:
        found = store.RunFolder.open(tmp_path).header
    except InputError:
        return
    assert found == json.loads(content)


@pytest.mark.slow
@settings(max_examples=40, deadline=None, suppress_health_check=list(HealthCheck))
@given(where=st.floats(0, 1, exclude_max=True))
def test_no_bit_of_a_result_file_gives_another_number(whole, tmp_path, where):
    content = (whole.folder / "study.nc").read_bytes()
    file = tmp_path / "study.nc"
    file.write_bytes(flipped(content, int(where * 8 * len(content))))
    try:
        found = read_dataset(file)
    except InputError as error:
        assert "study.nc" in str(error)
        return
    assert found.identical(whole.dataset) or found.equals(whole.dataset)


def test_the_checksum_covers_all_a_reader_sees(tmp_path):
    plain = xr.Dataset(
        {"a": ("x", [1.0, np.nan], {"units": "mm"})}, {"x": np.array(["p", "q"])}, {"format": 1}
    )

    def written(change):
        changed = plain.copy(deep=True)
        write_dataset(changed, tmp_path / "f.nc")
        change(tmp_path / "f.nc")
        return read_dataset(tmp_path / "f.nc")

    import h5py

    def setter(path, name, value):
        with h5py.File(path, "r+") as file:
            if name == "a":
                file["a"][0] = value
            elif name == "x":
                file["x"][0] = value
            else:
                file.attrs[name] = value

    assert written(lambda path: None).equals(plain)
    for name, value in (("a", 2.0), ("a", np.nan), ("seed", 3)):
        with pytest.raises(InputError, match="checksum"):
            written(lambda path, n=name, v=value: setter(path, n, v))


def test_damaged_signals_are_written_again(tmp_path):
    asked = {"signals": True, "motions": (short_motion("one"),)}
    study = run_study(small(tmp_path, **asked))
    before = (tmp_path / "signals.nc").read_bytes()
    values = study.signals("one", "passthrough").x_m.values
    at = before.index(values[0, 300:301].tobytes())
    (tmp_path / "signals.nc").write_bytes(flipped(before, 8 * at + 5))
    with pytest.raises(InputError, match=r"signals\.nc is damaged"):
        study.signals("one", "passthrough")
    run_study(small(tmp_path, **asked))
    assert (tmp_path / "signals.nc").read_bytes() == before


def test_plants_are_those_of_the_run(tmp_path):
    study = run_study(small(tmp_path, draws="lhs"))
    before, text = result_bytes(tmp_path), (tmp_path / "plants.csv").read_text()
    rows = text.splitlines()
    rows[3] = rows[3].replace("0.", "1.", 1)
    (tmp_path / "plants.csv").write_text("\n".join(rows) + "\n")
    with pytest.raises(InputError, match=r"plants\.csv is damaged"):
        merge_runs(tmp_path, signals=False)
    run_study(small(tmp_path, draws="lhs"))
    assert (tmp_path / "plants.csv").read_text() == text
    assert result_bytes(study.folder) == before


def test_nothing_of_others_is_deleted(copy):
    """Hidden files that look like temporaries, folders of such names, files in sub-folders."""
    (copy / "sub" / ".x.part1").mkdir(parents=True)
    names = (".video.part1.mkv", "sub/.thesis.part2.tex", ".run.1.part.json")
    mine = [copy / name for name in names]
    for path in mine:
        path.write_text("mine")
    again(copy)
    run_study(small(copy, seed=3), fresh=True)
    assert all(path.read_text() == "mine" for path in mine) and (copy / "sub" / ".x.part1").is_dir()
    assert not (copy / ".martths").exists()


def test_damaged_provenance_is_kept_aside(copy):
    (copy / "provenance.json").write_text('{"sessions": [1]}')
    again(copy)
    assert (copy / "provenance.json.damaged").read_text() == '{"sessions": [1]}'
    assert len(json.loads((copy / "provenance.json").read_text())["sessions"]) == 1


def test_machines_that_compile_otherwise_do_not_mix_unasked(whole, copy, tmp_path, monkeypatch):
    real = machine.machine_identity()
    other = real | {"instructions": real["instructions"] + " avx1024"}
    monkeypatch.setattr(machine, "machine_identity", lambda: other)
    monkeypatch.setattr("martths_jax.campaign.session.machine_identity", lambda: other)
    with pytest.raises(InputError, match=r"machine\.instructions.*avx1024.*--allow-mixed"):
        run_study(small(copy, trials=30))
    assert result_bytes(copy) == result_bytes(whole.folder)
    share = run_study(small(tmp_path / "b"), share=(2, 2))
    assert share is None
    monkeypatch.undo()
    run_study(small(tmp_path / "a"), share=(1, 2))
    with pytest.raises(InputError, match="allow-mixed"):
        merge_runs(tmp_path / "c", [tmp_path / "a", tmp_path / "b"], signals=False)
    says = Says()
    merged = merge_runs(
        tmp_path / "c", [tmp_path / "a", tmp_path / "b"], signals=False, allow_mixed=True,
        reporter=says,
    )  # fmt: skip
    assert sum("mixed" in text for text in says.said) == 1
    assert len(json.loads(merged.dataset.attrs["machines"])) == 2
    assert open_study(tmp_path / "c").dataset.value.equals(whole.dataset.value)
    says = Says()
    shares = [tmp_path / "a", tmp_path / "b"]
    merge_runs(tmp_path / "a", shares, signals=False, allow_mixed=True, reporter=says)
    assert sum("mixed" in text for text in says.said) == 1, "a folder that is there says it itself"


def test_flags_that_change_no_number_do_not_count():
    flags = "--xla_force_host_platform_device_count=3 --xla_cpu_max_isa=AVX --xla_dump_to=/x"
    assert machine.flags_that_count(flags) == ["--xla_cpu_max_isa=AVX"]


def test_a_folder_behind_a_link_is_the_same_folder(whole, copy, tmp_path):
    (tmp_path / "link").symlink_to(copy)
    again(tmp_path / "link", trials=30)
    assert open_study(copy).dataset.sizes["trial"] == 31


def test_no_more_open_files_is_one_sentence(tmp_path, monkeypatch):
    def refuse(*_):
        raise OSError(errno.EMFILE, os.strerror(errno.EMFILE))

    monkeypatch.setattr(os, "replace", refuse)
    with pytest.raises(InputError, match=r"Too many open files.*ulimit -n"):
        write_text(tmp_path / "summary.md", "text")
    assert not list(tmp_path.iterdir())
