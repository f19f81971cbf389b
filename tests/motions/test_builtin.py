"""The built-in motions meet their targets, and an ensemble differs and repeats."""

import json

import numpy as np
import pytest

from martths_jax.errors import InputError
from martths_jax.motions import (
    BUILTIN_NAMES,
    load_motion,
    load_record,
    response_spectrum,
    write_ensemble,
)
from martths_jax.motions.builtin import builtin_facts, builtin_record, fit_of, generate, measure
from martths_jax.motions.builtin.facts import FACTS_FILE, FRACTIONS, PERIODS, to_plain
from martths_jax.motions.builtin.matching import _hat_responses, _spectrum_misfit, match
from martths_jax.motions.builtin.start import random_start
from martths_jax.motions.builtin.store import cached

from .places import need_records


@pytest.fixture(autouse=True)
def own_cache(tmp_path_factory, monkeypatch):
    monkeypatch.setenv("MARTHS_CACHE", str(tmp_path_factory.getbasetemp() / "cache"))


@pytest.mark.parametrize("name", BUILTIN_NAMES)
def test_built_in_motion_meets_its_target(name):
    record, facts = load_record(name), builtin_facts(name)
    fit = fit_of(record.acceleration, facts)
    assert fit.accepted, fit
    # The same judged here from scratch, so that `fit_of` cannot be what is wrong.
    judged = (PERIODS >= 0.03) & (PERIODS <= 2.0)
    spectrum = response_spectrum(record.acceleration, record.dt, PERIODS)
    misfit = np.abs(spectrum / facts.spectrum - 1)[judged]
    assert np.mean(misfit) <= 0.05 and np.max(misfit) <= 0.15
    assert record.pga == pytest.approx(facts.pga, rel=0.10)
    quiet = np.concatenate([record.acceleration[: facts.active.start],
                            record.acceleration[facts.active.stop :]])  # fmt: skip
    assert quiet.size * record.dt > 9.9 and not np.any(quiet)


def test_names_say_that_they_are_not_the_records():
    motion = load_motion("elcentro-like")
    assert (motion.name, motion.source, motion.scale) == ("elcentro-like", "built-in", 0.4)
    assert len(motion.sha256) == 64
    assert motion.notices == ()


def test_data_file_holds_facts_and_no_samples():
    stored = json.loads(FACTS_FILE.read_text())
    assert sum(1 for t in PERIODS if 0.02 <= t <= 5) >= 100 and FRACTIONS.size >= 20
    for facts in stored["records"].values():
        longest = max(np.size(value) for value in facts.values())
        assert longest < facts["samples"] / 5
        assert len(facts["spectrum"]) == PERIODS.size


@pytest.mark.parametrize("name", ["elcentro", "kobe", "morganhill"])
def test_facts_are_those_of_the_real_record(name):
    facts = to_plain(measure(load_record(name, records=need_records())))
    stored = json.loads(FACTS_FILE.read_text())["records"][name]
    assert facts.keys() == stored.keys()
    for key, value in facts.items():
        np.testing.assert_allclose(value, stored[key], rtol=2e-4, atol=1e-3, err_msg=key)


def test_built_in_is_not_the_record_in_disguise():
    real = load_record("elcentro", records=need_records()).acceleration
    made = load_record("elcentro-like").acceleration
    scale = np.sqrt(np.sum(real**2) * np.sum(made**2))
    assert np.abs(np.correlate(real, made, "full")).max() / scale < 0.6


@pytest.mark.slow
def test_making_is_repeatable_and_stable_against_rounding():
    facts = builtin_facts("elcentro")
    start = random_start(facts, 7)
    rounding = 1 + 1e-13 * np.random.default_rng(0).standard_normal(start.size)
    first, other = match(start, facts), match(start * rounding, facts)
    assert np.abs(first - other).max() < 1e-8
    np.testing.assert_array_equal(generate(facts, 7), np.round(first, 6))


@pytest.mark.slow
def test_broken_cache_is_passed_over(tmp_path, monkeypatch):
    monkeypatch.setenv("MARTHS_CACHE", str(tmp_path))
    builtin_record.cache_clear()
    good = builtin_record("elcentro-like").acceleration
    (kept,) = tmp_path.glob("*.motion")
    kept.write_bytes(b"not an array")
    builtin_record.cache_clear()
    again = builtin_record("elcentro-like")
    np.testing.assert_array_equal(again.acceleration, good)
    assert any("was damaged" in notice for notice in again.notices)
    builtin_record.cache_clear()
    assert builtin_record("elcentro-like").notices == ()


def test_gradient_of_the_spectrum_is_its_derivative():
    facts = builtin_facts("elcentro")
    a = random_start(facts, 1)
    hats = _hat_responses(facts)
    misfit, rows = _spectrum_misfit(a, facts, hats)
    change = random_start(facts, 2) * 1e-7
    moved, _ = _spectrum_misfit(a + change, facts, hats)
    assert moved.size == misfit.size
    expected = rows @ change
    np.testing.assert_allclose(misfit - moved, expected, atol=1e-4 * np.abs(expected).max())


@pytest.mark.slow
def test_ensemble_is_different_accepted_and_readable(tmp_path):
    lines = write_ensemble("elcentro", 2, tmp_path / "e", seed=1)
    assert [line["accepted"] for line in lines] == [True, True]
    motions = [load_motion(tmp_path / "e" / line["file"], scale=1.0) for line in lines]
    a, b = (m.acceleration for m in motions)
    assert np.abs(np.corrcoef(a, b)[0, 1]) < 0.5
    facts = builtin_facts("elcentro")
    record = load_record(tmp_path / "e" / lines[0]["file"])
    assert fit_of(record.acceleration, facts).accepted
    again = write_ensemble("elcentro-like", 1, tmp_path / "again", seed=1)
    assert again[0] == lines[0]  # member 1 does not depend on how many follow
    with pytest.raises(InputError, match="already holds"):
        write_ensemble("elcentro", 1, tmp_path / "e")


def test_senseless_ensembles_are_refused(tmp_path):
    for arguments, word in (
        (("nowhere", 1, tmp_path / "x"), "nowhere"),
        (("elcentro", 0, tmp_path / "x"), "count"),
        (("elcentro", 1, __file__), "cannot be written"),
    ):
        with pytest.raises(InputError, match=word):
            write_ensemble(*arguments)
    (tmp_path / "short.csv").write_text("a [g]\n# dt = 0.01\n" + "\n".join("0 1 -1 0".split()))
    with pytest.raises(InputError, match="at least 4 s"):
        write_ensemble(str(tmp_path / "short.csv"), 1, tmp_path / "x")


def test_a_flipped_bit_of_a_kept_motion_is_never_accepted(tmp_path, monkeypatch):
    monkeypatch.setenv("MARTHS_CACHE", str(tmp_path))
    facts = builtin_facts("elcentro")
    good = builtin_record("elcentro-like").acceleration
    made = []

    def make():
        made.append(1)
        return good

    cached("elcentro-like", facts, make)
    (kept,) = tmp_path.glob("*.motion")
    whole = kept.read_bytes()
    assert cached("elcentro-like", facts, make)[1] == () and len(made) == 1
    draw = np.random.default_rng(0)
    for bit in draw.integers(0, 8 * len(whole), 60):
        broken = bytearray(whole)
        broken[bit // 8] ^= 1 << (bit % 8)
        kept.write_bytes(broken)
        values, notices = cached("elcentro-like", facts, make)
        np.testing.assert_array_equal(values, good)
        assert len(notices) == 1 and "was damaged" in notices[0]
        assert kept.read_bytes() == whole  # put right, so that it is said once
    assert len(made) == 61


def test_another_motion_under_the_right_digest_is_not_accepted(tmp_path, monkeypatch):
    monkeypatch.setenv("MARTHS_CACHE", str(tmp_path))
    facts = builtin_facts("elcentro")
    good = builtin_record("elcentro-like").acceleration
    cached("elcentro-like", facts, lambda: 1.01 * good)  # a digest of its own bytes, and wrong
    values, notices = cached("elcentro-like", facts, lambda: good)
    np.testing.assert_array_equal(values, good)
    assert notices
    rounded = good + 1e-6 * (np.arange(good.size) % 7 == 0)  # what another machine may make
    (kept,) = tmp_path.glob("*.motion")
    kept.unlink()
    cached("elcentro-like", facts, lambda: rounded)
    assert cached("elcentro-like", facts, lambda: good)[1] == ()
