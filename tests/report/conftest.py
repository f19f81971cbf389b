from tests.figures.small_study import study_folder  # noqa: F401
