"""Numbers beyond all bounds: one sentence each, before anything is built or taken."""

import sys

import numpy as np
import pytest

from martths_jax import ADFC, InputError
from martths_jax.campaign import draws as draws_module
from martths_jax.campaign import memory
from martths_jax.campaign.config import make_config, read_toml
from martths_jax.campaign.draws import even_draws
from martths_jax.campaign.fields import FIELDS, MOST_TRIALS
from martths_jax.campaign.plan import build_plan
from martths_jax.cli import main
from martths_jax.sensitivity.design import most_samples
from martths_jax.sensitivity.runner import build
from martths_jax.study.runner import run_study
from martths_jax.study.summary import summarise
from martths_jax.text import shortened
from tests.study.places import short_motion, small

HUGE = 10**400  # beyond every float
LONGEST = 10**5000  # beyond what Python writes out


@pytest.mark.parametrize("name", [f.name for f in FIELDS if f.name not in ("out",)])
def test_no_setting_is_beyond_bounds(name):
    if name in ("seed", "scale", "spread", "pga", "fs", "noise_power", "memory_gb"):
        assert getattr(make_config({name: 10**12}), name) == 10**12
    for value in (HUGE, -HUGE, LONGEST, float("inf")):
        with pytest.raises(InputError, match=f"`{name}` must") as caught:
            make_config({name: (value,) if name == "keep" else value})
        assert len(str(caught.value)) < 400


def test_most_trials():
    assert make_config(trials=MOST_TRIALS).trials == MOST_TRIALS
    with pytest.raises(InputError, match=f"from 1 to {MOST_TRIALS}"):
        make_config(trials=MOST_TRIALS + 1)


def test_numbers_of_numpy_are_numbers():
    config = make_config(trials=np.int64(5), scale=np.float32(0.5), signals=np.bool_(False))
    assert (config.trials, config.scale, config.signals) == (5, 0.5, False)
    assert type(config.trials) is int and type(make_config(config, seed=np.int8(3)).seed) is int


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (f"[study]\nseed = {'9' * 4000}", r"`seed` must .* \(4000 characters\)"),
        (f"[study]\nseed = {'9' * 5000}", "is not valid TOML: .*4300"),
        (f"[study]\ntrials = {'[' * 3000}", "nests its brackets too deeply"),
        (f"[study]\ntrials = {'{a=' * 3000}", "nests its brackets too deeply"),
        ("[study]\ntrials = 1e12", "`trials` must"),
    ],
)
def test_files_beyond_bounds(text, message, tmp_path):
    path = tmp_path / "study.toml"
    path.write_text(text)
    with pytest.raises(InputError, match=message) as caught:
        read_toml(path)
    assert len(str(caught.value)) < 500


def test_results_that_do_not_fit_are_refused_before_they_run(tmp_path):
    with pytest.raises(InputError, match=r"Results of \d+ trials take .* GB are free"):
        run_study(small(tmp_path, trials=MOST_TRIALS))
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(("kind", "trials"), [("sobol", 2**30 + 1), ("lhs", MOST_TRIALS)])
def test_even_draws_that_cannot_be_made(kind, trials, monkeypatch):
    with pytest.raises(InputError, match=f"`trials` must be at most .* {kind} draws"):
        even_draws(kind, trials, 1, 9)
    monkeypatch.setattr(draws_module, "available_memory", lambda: 1e5)
    with pytest.raises(InputError, match="at most 347"):
        even_draws(kind, 400, 1, 9)
    assert even_draws(kind, 8, 1, 9).shape == (8, 9)


def test_buffers_beyond_memory(tmp_path, benchmark):
    config = make_config(
        small(tmp_path), controllers=("adfc",), controller={"adfc": {"nb": 10**10}}
    )
    with pytest.raises(InputError, match=r"`nb` must be at most \d+, whose rows fit into memory"):
        build_plan(config)
    assert not ADFC(nb=100_000).problems(benchmark)


def test_designs_beyond_memory():
    assert 2**10 <= most_samples() <= 2**30
    with pytest.raises(InputError, match=r"`trials` must be at most .* design fits into memory"):
        build({"trials": 2**29}, ("J2_1",), {})


def test_no_memory_is_a_sentence(monkeypatch, capsys, tmp_path):
    def refuse(*_):
        raise MemoryError("Unable to allocate 9 TiB")

    monkeypatch.setattr("martths_jax.cli.study.run_study", lambda *_, **__: refuse())
    monkeypatch.setattr(sys, "argv", ["martths", "study", "--trials", "5", "--out", str(tmp_path)])
    with pytest.raises(SystemExit) as stop:
        main()
    assert stop.value.code == 2
    told = capsys.readouterr().err
    assert "not enough memory (Unable to allocate 9 TiB)" in told and "Traceback" not in told


def test_values_in_messages_are_cut():
    assert shortened(5) == "5" and shortened(LONGEST) == "a number of more than 4300 digits"
    assert shortened("x" * 100).endswith("... (102 characters)")


def test_the_title_counts_trials_with_all_indices(tmp_path):
    config = make_config(small(tmp_path, motions=(short_motion(),), trials=3))
    from martths_jax.campaign.session import header
    from martths_jax.campaign.store import RunFolder
    from martths_jax.study.runner import write_results
    from tests.study.small_outcome import outcome

    run = RunFolder.start(tmp_path, header(build_plan(config), ""))
    value = outcome(4).value
    value[2, 15:] = np.inf  # a motion of zeros: nothing to divide by
    run.write("passthrough", "one", np.arange(4), outcome(4, value=value))
    titles = [table.title for table in summarise(write_results(run).dataset).tables]
    assert "passthrough on one: 2 of 3 trials" in titles


def test_results_of_the_default_study_are_small(monkeypatch):
    monkeypatch.setattr(memory, "available_memory", lambda: 4e6)
    memory.check_results(1001, 6)
    with pytest.raises(InputError, match=r"Results of 10001 trials take 0\.0346 GB"):
        memory.check_results(10_001, 6)
