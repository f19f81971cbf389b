import pytest

from martths_jax.study import provenance


@pytest.fixture(autouse=True, scope="package")
def same_commit():
    """Results name the commit they come from; it must not change while the tests run."""
    patch = pytest.MonkeyPatch()
    patch.setattr(provenance, "git_commit", lambda: "0000000")
    yield
    patch.undo()
