"""Where work begins: double precision, an unforked process, devices that are there."""

import os
import subprocess
import sys

import jax
import numpy as np
import pytest

from martths_jax import (
    ADFC,
    LQG,
    InputError,
    Passthrough,
    SensorNoise,
    build_benchmark,
    build_coupler,
    draw_plants,
    indices,
    nominal_plant,
    plant_from_draws,
    plant_from_hz,
    runtime,
    simulate,
)
from martths_jax.algebra.riccati import care, dare
from martths_jax.control.controllers.lqg import lqg_from_weights
from martths_jax.control.design.lqg import WEIGHTS, kalman_gain
from martths_jax.control.estimators import design_kalman
from martths_jax.plant import NOMINAL_HZ
from martths_jax.sensitivity import run_sensitivity
from martths_jax.stability import delay_margin, linear_loop, spectral_radius
from martths_jax.study import run_study
from martths_jax.sweep import run_sweep
from martths_jax.tune.gradient import Gradient
from martths_jax.tune.objective import Objective
from martths_jax.tune.search import Options, tune
from tests.engine.motions import burst

MOTION = burst(0.3)
LOGS = dict.fromkeys(WEIGHTS, 0.0)


@pytest.fixture(scope="module")
def made(benchmark):
    """What was made in double precision, a finished run among it."""
    return {
        "benchmark": benchmark,
        "lqg": LQG.design(benchmark),
        "plants": nominal_plant(),
        "result": simulate(benchmark, Passthrough(), nominal_plant(), MOTION),
    }


BEGINNINGS = {
    "build_benchmark": lambda m: build_benchmark(),
    "build_coupler": lambda m: build_coupler(),
    "draw_plants": lambda m: draw_plants(2),
    "plant_from_draws": lambda m: plant_from_draws(np.zeros(9)),
    "plant_from_hz": lambda m: plant_from_hz(NOMINAL_HZ),
    "nominal_plant": lambda m: nominal_plant(),
    "discretise": lambda m: m["plants"].discretise(1 / 1024),
    "SensorNoise.draw": lambda m: SensorNoise().draw(np.arange(2), 10, 1024.0),
    "LQG.design": lambda m: LQG.design(m["benchmark"]),
    "simulate": lambda m: simulate(m["benchmark"], m["lqg"], m["plants"], MOTION),
    "simulate again": lambda m: simulate(m["benchmark"], Passthrough(), m["plants"], MOTION),
    "indices": lambda m: indices(m["result"]),
    "design_kalman": lambda m: design_kalman(m["benchmark"].plant_model, 1e-5, 1e-4),
    "lqg_from_weights": lambda m: lqg_from_weights(m["benchmark"], LOGS),
    "kalman_gain": lambda m: kalman_gain(m["benchmark"], 1e-5),
    "care": lambda m: care(-np.eye(2), np.eye(2), np.eye(2), np.eye(2)),
    "dare": lambda m: dare(np.eye(2) / 2, np.eye(2), np.eye(2), np.eye(2)),
    "linear_loop": lambda m: linear_loop(m["benchmark"], m["lqg"], m["plants"]),
    "spectral_radius": lambda m: spectral_radius(m["benchmark"], m["lqg"], m["plants"]),
    "delay_margin": lambda m: delay_margin(m["benchmark"], m["lqg"], m["plants"]),
    "frozen": lambda m: ADFC().frozen(m["benchmark"], np.zeros((8, 2))),
    "run_study": lambda m: run_study(trials=1, out=m["folder"]),
    "run_sweep": lambda m: run_sweep({"nb": [64]}, trials=1, out=m["folder"]),
    "run_sensitivity": lambda m: run_sensitivity(trials=2, out=m["folder"]),
    "tune": lambda m: tune(m["benchmark"], Options("lqg", "j2"), [MOTION], m["folder"]),
    "Gradient": lambda m: Gradient(
        m["benchmark"], "lqg", Objective.parse("j2"), m["plants"], [MOTION]
    ),
}


@pytest.mark.parametrize("name", BEGINNINGS)
def test_single_precision_is_one_sentence_wherever_work_begins(name, made, tmp_path):
    """After runs in double precision, whose programs and arrays are there to be used again."""
    folder = tmp_path / "out"
    with jax.enable_x64(False), pytest.raises(InputError) as caught:
        BEGINNINGS[name](made | {"folder": folder})
    text = str(caught.value)
    assert text.startswith("Setting `jax_enable_x64` of JAX must be True") and "\n" not in text
    assert not folder.exists()


def test_the_setting_itself_and_back_again(made):
    before = indices(made["result"])["J2_1"]
    jax.config.update("jax_enable_x64", False)
    try:
        with pytest.raises(InputError, match="jax_enable_x64"):
            simulate(made["benchmark"], Passthrough(), made["plants"], MOTION)
    finally:
        jax.config.update("jax_enable_x64", True)
    again = simulate(made["benchmark"], Passthrough(), made["plants"], MOTION)
    np.testing.assert_array_equal(indices(again)["J2_1"], before)


@pytest.mark.parametrize("given", ["two", "-1", "0", "100000", "1.5", "²", "9" * 5000])
def test_a_number_of_devices_that_is_none(given, monkeypatch):
    monkeypatch.setenv("MARTHS_DEVICES", given)
    assert runtime._asked_devices() is None
    with pytest.raises(InputError, match="MARTHS_DEVICES must be a whole number from 1 to") as told:
        runtime.check_devices()
    assert len(str(told.value)) < 250


def test_a_number_of_devices(monkeypatch):
    for given, number in ((" 3 ", 3), ("256", 256), ("", None)):
        monkeypatch.setenv("MARTHS_DEVICES", given)
        assert runtime._asked_devices() == number
        runtime.check_devices()


FORK = """
import multiprocessing as mp
from martths_jax import InputError, draw_plants, nominal_plant
nominal_plant()
def child():
    try:
        draw_plants(2)
    except InputError as error:
        print(error, flush=True)
one = mp.get_context("fork").Process(target=child)
one.start(); one.join(60)
print("hangs" if one.is_alive() else "ended", flush=True); one.kill()
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="this system cannot fork")
def test_a_fork_after_the_first_run_is_told_to_spawn():
    done = python("-c", FORK)
    assert "was forked from one in which JAX had started" in done.stdout
    assert '"spawn"' in done.stdout and "ended" in done.stdout


@pytest.mark.slow
def test_surroundings_that_cannot_be_used_end_the_command_in_a_sentence(tmp_path):
    command = "from martths_jax.cli import main; main()"
    done = python("-c", command, "modes", MARTHS_DEVICES="two")
    assert done.returncode == 2 and "MARTHS_DEVICES must be a whole number" in done.stderr
    assert "Traceback" not in done.stderr
    words = ["run", "--motion", "kobe-like", "--out", str(tmp_path / "x")]
    done = python("-c", command, *words, JAX_PLATFORMS="nowhere")
    assert done.returncode == 2 and "cannot start the platform 'nowhere'" in done.stderr
    assert "Traceback" not in done.stderr


def python(*words, **environment):
    return subprocess.run(
        [sys.executable, *words], capture_output=True, text=True, timeout=300,
        env=os.environ | environment,
    )  # fmt: skip
