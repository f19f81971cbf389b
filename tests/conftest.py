"""What all tests share: quick compilation, and where the real records are, if they are.

Tests run short motions, so most of their time would be the compiler's: it is told not to optimise,
except where the fixture ``optimised`` is used.  `MARTHS_TEST_OPTIMISED=1` runs all of them as users
run the package.
"""

from __future__ import annotations

import os
from pathlib import Path

import pytest

if not os.environ.get("MARTHS_TEST_OPTIMISED"):
    quick = "--xla_backend_optimization_level=0"
    os.environ["XLA_FLAGS"] = f"{os.environ.get('XLA_FLAGS', '')} {quick}".strip()

import jax

import martths_jax  # before any test touches JAX: it switches float64 on
from martths_jax import blocks, runtime

# Arrays of other ranks or types are never combined by chance.
jax.config.update("jax_numpy_rank_promotion", "raise")
jax.config.update("jax_numpy_dtype_promotion", "strict")

SIBLING = Path(__file__).resolve().parents[2] / "shared" / "benchmark"


def pytest_addoption(parser):
    parser.addoption("--all", action="store_true", help="run the slow tests too, as CI does")


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(config, items):
    leave_slow_out(config, items)


def leave_slow_out(config, items) -> None:
    """Leave the slow tests out, unless all are wanted or some are named; pytest counts them."""
    named = any("::" in word for word in config.args) or config.option.markexpr
    if config.option.all or os.environ.get("CI") or named:
        return
    slow = [item for item in items if item.get_closest_marker("slow")]
    if slow:
        config.hook.pytest_deselected(items=slow)
        items[:] = [item for item in items if item not in slow]


@pytest.fixture(scope="session")
def records() -> Path:
    """Folder of the real records, reference matrices and oracle signals."""
    folder = Path(os.environ.get("MARTHS_RECORDS") or SIBLING)
    if not (folder / "ElCentroAccelNoScaling.mat").exists():
        pytest.skip(
            f"the benchmark's real records are not at {folder}; set MARTHS_RECORDS to their folder"
        )
    return folder


@pytest.fixture(scope="session")
def benchmark():
    """The benchmark with its defaults."""
    return martths_jax.build_benchmark()


@pytest.fixture
def optimised(monkeypatch):
    """Compile simulations as users do: for long motions, and for what depends on the compiler."""
    best = runtime.compiler_options() | {"xla_backend_optimization_level": 3}
    monkeypatch.setattr(blocks, "compiler_options", lambda: best)
    blocks.compiled.cache_clear()
    yield
    blocks.compiled.cache_clear()
