"""The commented problem file to start from."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path

from martths_jax.errors import InputError
from martths_jax.files import atomic


def template() -> str:
    """Text of a commented problem file."""
    return files(__package__).joinpath("template.toml").read_text("utf-8")


def write_template(path: Path | str, overwrite: bool = False) -> None:
    """Write the commented problem file.

    Raises:
        InputError: if the file exists already or cannot be written.
    """
    path = Path(path)
    if path.exists() and not overwrite:
        raise InputError(f"{path} exists already; give another name, or `overwrite`.")
    with atomic(path) as part:
        part.write_text(template(), "utf-8")
