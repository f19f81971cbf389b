import os

import pytest

from martths_jax.campaign import provenance


@pytest.fixture(autouse=True, scope="package")
def same_commit():
    """Results name the commit they come from; it must not change while the tests run."""
    patch = pytest.MonkeyPatch()
    patch.setattr(provenance, "git_commit", lambda: "0000000")
    yield
    patch.undo()


@pytest.fixture(scope="session")
def compile_cache(tmp_path_factory):
    """Environment of the processes that tests start: they share compiled programs."""
    return os.environ | {
        "JAX_COMPILATION_CACHE_DIR": str(tmp_path_factory.mktemp("compiled")),
        "JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS": "0",
    }
