"""A whole problem from a file: its rig, its faults by line, and that it runs."""

import re
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest

from martths_jax import ADFC, InputError, Passthrough, build_benchmark, simulate
from martths_jax.benchmark import LAYOUT
from martths_jax.control.check import check_controller
from martths_jax.control.controllers import ENTRIES
from martths_jax.indices import GROUPS, groups_of, indices
from martths_jax.problem import find_problem
from martths_jax.problem.file.problem import read_problem
from martths_jax.problem.file.template import template
from martths_jax.structure.modal import to_dense
from tests.engine.motions import burst

EXAMPLES = Path(__file__).parents[2] / "experiments" / "problems"


def written(tmp_path, text=None, **changes):
    """The template in a file, with parts of its text replaced."""
    text = template() if text is None else text
    for old, new in changes.values():
        assert old in text, old
        text = text.replace(old, new, 1)
    path = tmp_path / "frame.toml"
    path.write_text(text, "utf-8")
    return path


def line_of(path, text) -> int:
    lines = path.read_text("utf-8").splitlines()
    return next(n for n, line in enumerate(lines, 1) if text in line)


def test_the_template_is_a_problem_of_two_actuators(tmp_path):
    made = read_problem(written(tmp_path))
    assert made.rig.actuators == ("upper", "lower")
    assert made.structure.interface == ("b.x", "b.rotation")
    # Hinges 0.25 m above and below the node, counter-clockwise rotation positive.
    np.testing.assert_allclose(made.rig.coupler.jacobian(), [[1e3, -250], [1e3, 250]], atol=1e-9)
    assert made.rig.plant.uncertainty.names == ("slow",)


def test_laboratory_and_computed_part_make_the_whole(tmp_path):
    """Static stiffness of the discrete systems: the reference's is the numerical part's plus the
    specimen's, by the static gain from a force at the interface."""
    problem = find_problem(str(written(tmp_path)))
    built = problem.build(1024.0, "zoh")
    gains = []
    for system in (built.numerical, built.reference):
        A, B, C, D = to_dense(system)
        static = D + C @ np.linalg.solve(np.eye(len(A)) - A, B)
        gains.append(static[:2, 1:])
    numerical, reference = (np.linalg.inv(g) for g in gains)
    specimen = np.asarray(built.specimen.taps).sum(axis=0)  # a motion that stays
    np.testing.assert_allclose(numerical + specimen, reference, rtol=1e-6)


FAULTS = {
    "an actuator too few": (
        '[[actuators]]\nname = "lower"', '[[shakers]]\nname = "lower"',
        None, "must be as many as the degrees of freedom, but got 1 for x, r",
    ),
    "actuators through one point": (
        "attachment = [0.0, -0.25]\nbase = [-1.5, -0.25]",
        "attachment = [0.0, 0.25]\nbase = [-1.5, 0.25]",
        "[[actuators]]", "upper and lower are parallel",
    ),
    "an unknown actuator of the plant": (
        'output = "upper"', 'output = "uper"', 'output = "uper"',
        "names 'uper', which is unknown: the nearest is upper",
    ),
    "an unstable pole": (
        "slow = {nominal = -20.0", "slow = {nominal = 20.0", "[[plant]]", "stable",
    ),
    "more zeros than poles": (
        "zeros = []", "zeros = [-1.0, -2.0, -3.0, -4.0]", "[[plant]]", "proper",
    ),
    "an unknown uncertain parameter": (
        '"slow", {re', '"slwo", {re', "[[plant]]", "slwo",
    ),
    "a sigma below zero": (
        "sigma = 0.05", "sigma = -0.05", "slow = {", "`sigma` in [uncertain.slow] must be",
    ),
    "a rate too slow for a pole": (
        "fs = 1024.0", "fs = 100.0", "fs = 100.0", "twice the magnitude of the plant's fastest",
    ),
    "a plant twice": (
        'output = "lower"\ninput = "lower"', 'output = "upper"\ninput = "upper"',
        "[[plant]]", "A second plant leads from upper to upper",
    ),
    "an unknown key": (
        "volt_per_mm = 0.127", "volts_per_mm = 0.127", "volts_per_mm", "volts_per_mm",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", FAULTS)
def test_a_fault_is_a_sentence_with_its_line(tmp_path, name):
    old, new, line, sentence = FAULTS[name]
    path = written(tmp_path, change=(old, new))
    with pytest.raises(InputError, match=re.escape(sentence)) as told:
        read_problem(path)
    if line is not None:
        numbers = [int(n) for n in re.findall(r"line (\d+):", str(told.value))]
        text = path.read_text("utf-8").splitlines()
        assert any(line in text[n - 1] for n in numbers), str(told.value)


def test_a_degree_of_freedom_that_no_actuator_reaches(tmp_path):
    text = re.sub(r'node = "b"\nattachment = .*\nbase = .*', 'dof = "b.x"', template())
    path = written(tmp_path, text)
    line = line_of(path, "interface =")
    with pytest.raises(InputError, match=rf"line {line}: No actuator reaches b\.rotation") as told:
        read_problem(path)
    assert "Two actuators move b.x" in str(told.value)


def test_a_correlation_that_is_not_positive_definite(tmp_path):
    more = '\nfast = {nominal = 1.0, sigma = 0.1}\n[[correlation]]\nbetween = ["slow", "fast"]\n'
    path = written(tmp_path, template() + more + "value = 1.2\n")
    with pytest.raises(InputError, match="correlation"):
        read_problem(path)


def test_all_faults_come_at_once(tmp_path):
    path = written(
        tmp_path,
        one=('output = "upper"', 'output = "uper"'),
        two=("sigma = 0.05", "sigma = -0.05"),
        three=("limit = 10.0", "limit = -1.0"),
    )
    with pytest.raises(InputError, match="3 problems"):
        read_problem(path)


def test_the_same_object_until_the_file_changes(tmp_path):
    path = written(tmp_path)
    first = find_problem(str(path))
    assert find_problem(str(path)) is first
    path.write_text(template().replace("noise_power = 1.5e-7", "noise_power = 3e-7"), "utf-8")
    again = find_problem(str(path))
    assert again is not first
    assert again.settings["noise_power"] == 3e-7
    assert again.place != first.place


def test_a_case_of_a_file_is_refused(tmp_path):
    with pytest.raises(InputError, match="be left out, a file has none"):
        find_problem(str(written(tmp_path)), 2)
    with pytest.raises(InputError, match=r"be one of marths, uniaxial, or a FILE\.toml"):
        find_problem("biaxial")
    with pytest.raises(InputError, match="be one of 1, 2, 3, 4, but got 7"):
        find_problem("uniaxial", 7)


def test_the_benchmarks_indices_are_those_of_its_layout():
    assert groups_of(LAYOUT) == GROUPS == groups_of()
    assert build_benchmark().layout == LAYOUT


@pytest.mark.parametrize("name", ["loading_unit", "shear_building", "tall_frame"])
def test_the_examples_can_be_used(name):
    problem = find_problem(str(EXAMPLES / f"{name}.toml"))
    n = {"loading_unit": 3, "shear_building": 1, "tall_frame": 2}[name]
    assert len(problem.layout.actuators) == n == len(problem.layout.interface)
    values = np.asarray(problem.draw(200, 1).values)
    assert values.shape == (200, len(problem.parameters))
    back = problem.readings["values"].draws(values, 1.0)
    np.testing.assert_allclose(back, problem.draw(200, 1).draws, atol=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["loading_unit", "shear_building"])
def test_adfc_tracks_better_than_nothing_on_the_examples(name):
    """One and three actuators, 4 and 12 unknowns: the same controller, made for two."""
    problem = find_problem(str(EXAMPLES / f"{name}.toml"))
    built, plants, motion = problem.build(1024.0), problem.draw(2, 3), burst(4.0)
    quiet = problem.noise(0.0, False, 0)
    found = [
        indices(simulate(built, controller, plants, motion, quiet))
        for controller in (ADFC(nb=512, no=511), Passthrough())
    ]
    names = [i.name for i in groups_of(problem.layout)["benchmark"] if i.group == "J2"]
    adfc, none = (np.stack([f[n] for n in names]) for f in found)
    assert np.all(np.isfinite(adfc))
    assert np.all((adfc < 0.6 * none) | ~np.isfinite(none))


@pytest.mark.slow
def test_a_study_keeps_the_file_and_finds_it_again(tmp_path):
    """The folder holds a copy: plants come from it when the file is gone and the folder moved."""
    from martths_jax.campaign.store import RunFolder
    from martths_jax.study import run_study

    path = written(tmp_path)
    run_study({
        "problem": str(path), "trials": 3, "controllers": ["passthrough"], "signals": False,
        "motions": [burst(1.0)], "out": str(tmp_path / "study"),
    })  # fmt: skip
    path.unlink()
    moved = (tmp_path / "study").rename(tmp_path / "elsewhere")
    run = RunFolder.open(moved)
    assert run.problem.layout.actuators == ("upper", "lower")
    assert run.draws().plants(jnp.arange(4)).values.shape == (4, 1)


ANY_NUMBER = ("adfc", "adfc-rls", "adfc-weighted", "error-model", "mff", "passthrough", "pi-lead")


@pytest.mark.parametrize("name", ["loading_unit", "shear_building"])
def test_controllers_take_any_number_of_actuators_or_say_which(name):
    """One sample of each on one and three actuators; those made for two say so before anything."""
    built = find_problem(str(EXAMPLES / f"{name}.toml")).build(1024.0)
    for entry in ENTRIES:
        if entry.name == "lqg":  # its default weights are a fit to the maRTHS benchmark
            weights = {"e": [1e9], "r": [1.0], "y": [1e3]}
            n = len(built.layout.actuators)
            made = entry.build(built, q=1e-4, **{k: v * n for k, v in weights.items()})
        elif entry.name in ANY_NUMBER:
            made = entry.build(built)
        else:
            with pytest.raises(InputError, match="is made for 2 actuators, but the problem has"):
                entry.build(built)
            continue
        check_controller(made.prepare(built), built, 4)


def test_what_the_examples_page_says_is_what_was_run():
    """Largest medians of J2 and J8, and lost trials, out of the committed summaries."""
    page = (EXAMPLES / "README.md").read_text("utf-8")
    for name in ("tall_frame", "loading_unit", "shear_building"):
        text = (EXAMPLES / "results" / f"{name}.md").read_text("utf-8")
        cells = []
        for controller in ("adfc", "passthrough"):
            head = rf"## {controller} on elcentro-like: (\d+) of 64 trials\n(.*?)\n## "
            whole, table = re.search(head, text, re.DOTALL).groups()
            found = []
            for group in ("J2", "J8"):
                medians = re.findall(
                    rf"^\| {group}_\S+ \[%\] \|[^|]*\| ([\d.]+) ", table, re.MULTILINE
                )
                largest = max(map(float, medians), default=None)
                found.append("–" if largest is None else f"{largest:.{0 if largest >= 10 else 1}f}")
            cells.append(f"{', '.join(found)}, {64 - int(whole)}")
        assert f"| {name} | {cells[0]} | {cells[1]} |" in page, (name, cells)
