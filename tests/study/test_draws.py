"""Plants of a study: where they come from, and that files give back what was drawn."""

import numpy as np
import pytest

from martths_jax import InputError, draw_plants
from martths_jax.campaign.config import make_config
from martths_jax.campaign.draws import Draws, even_draws, make_draws, read_plants, write_plants
from martths_jax.plant import NOMINAL_HZ, PARAMETERS, SIGMA
from tests.study.places import small


def test_draws_are_those_of_draw_plants_in_any_order():
    draws = Draws(1000, seed=3, spread=1.0)
    trial = np.array([617, 0, 1, 128, 127, 1000])
    given = draws.plants(trial)
    expected = np.asarray(draw_plants(1000, seed=3).draws)
    assert np.array_equal(given.draws[[0, 2, 3, 4, 5]], expected[trial[[0, 2, 3, 4, 5]] - 1])
    assert np.all(given.draws[1] == 0) and np.array_equal(given.trial, trial)


@pytest.mark.parametrize("kind", ["lhs", "sobol"])
def test_even_draws_fill_the_range_evenly(kind):
    draws = even_draws(kind, 256, 1, 9)
    from scipy.stats import norm

    assert draws.shape == (256, 9)
    # One draw in each of 256 equally likely intervals, in every parameter.
    for column in draws.T:
        assert np.array_equal(np.sort((norm.cdf(column) * 256).astype(int)), np.arange(256))
    assert np.array_equal(draws, even_draws(kind, 256, 1, 9))
    assert not np.array_equal(draws, even_draws(kind, 256, 2, 9))


def test_even_draws_cannot_be_extended(tmp_path):
    from martths_jax.study import run_study

    run_study(small(tmp_path, trials=8, draws="lhs"))
    with pytest.raises(InputError, match="trials: 8 in the folder, 16 asked for"):
        run_study(small(tmp_path, trials=16, draws="lhs"))


def test_plants_come_back_exactly(tmp_path):
    plants = draw_plants(40, seed=5, spread=1.5)
    write_plants(plants, tmp_path / "plants.csv")
    assert np.array_equal(read_plants(tmp_path / "plants.csv", spread=1.5), plants.draws)


@pytest.mark.parametrize(("kind", "factor"), [("hz", 1.0), ("rad/s", 2 * np.pi)])
def test_zeros_and_poles_without_header(tmp_path, kind, factor):
    """As MATLAB's writematrix leaves them."""
    plants = draw_plants(5, seed=5)
    values = np.array(plants.parameters_hz)
    values[:, NOMINAL_HZ != 1] *= factor
    np.savetxt(tmp_path / "p.csv", values, delimiter=",", fmt="%.17g")
    np.testing.assert_allclose(read_plants(tmp_path / "p.csv", kind), plants.draws, atol=1e-13)
    with pytest.raises(InputError, match="--plants-as"):
        read_plants(tmp_path / "p.csv")


def test_columns_are_found_by_name(tmp_path):
    names = [f"{p}_hz" for p in PARAMETERS][::-1]
    values = (NOMINAL_HZ * (1 + SIGMA))[::-1]
    text = ",".join(names) + "\n\n" + ",".join(map(repr, values.tolist())) + "\n"
    (tmp_path / "p.csv").write_text(text)
    np.testing.assert_allclose(read_plants(tmp_path / "p.csv"), np.ones((1, 9)), atol=1e-13)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "holds no plant"),
        (",".join(f"{p}_hz" for p in PARAMETERS) + "\n", "holds no plant"),
        ("1,2,3\n", "line 1: wanted 9 numbers"),
        ("1,2,3,4,5,6,7,8,9\n1,2,3,4,x,6,7,8,9\n", "line 2: wanted 9 numbers"),
        ("a,b,c\n1,2,3\n", "must have the columns zero1_col1_hz"),
    ],
)
def test_what_is_wrong_with_a_file_is_said(tmp_path, text, message):
    (tmp_path / "p.csv").write_text(text)
    with pytest.raises(InputError, match=message):
        read_plants(tmp_path / "p.csv", "draws")


def test_a_file_sets_the_number_of_trials_and_unstable_plants_are_refused(tmp_path):
    write_plants(draw_plants(7, seed=1), tmp_path / "p.csv")
    draws = make_draws(make_config(plants=str(tmp_path / "p.csv")))
    assert draws.trials == 7 and draws.sha256
    values = NOMINAL_HZ.copy()
    values[2] = 1.0
    np.savetxt(tmp_path / "u.csv", values[None], delimiter=",")
    with pytest.raises(InputError, match="stable"):
        make_draws(make_config(plants=str(tmp_path / "u.csv"), plants_as="hz"))
    with pytest.raises(InputError, match="cannot be read"):
        make_draws(make_config(plants=str(tmp_path / "none.csv")))


def test_a_study_of_exported_plants_is_the_same_study(tmp_path):
    from martths_jax.campaign.formats.plants import export_plants
    from martths_jax.study import run_study

    first = run_study(small(tmp_path / "a"))
    export_plants(first.dataset, tmp_path / "p.csv")
    again = run_study(small(tmp_path / "b", plants=str(tmp_path / "p.csv")))
    assert again.dataset.value.equals(first.dataset.value)
    assert again.dataset.draw.equals(first.dataset.draw)
