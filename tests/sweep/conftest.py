from tests.study.conftest import same_commit  # noqa: F401
