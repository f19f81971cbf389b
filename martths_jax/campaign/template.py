"""TOML of a configuration: the commented file to start from, and the effective one of a run."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from martths_jax.campaign.config import StudyConfig, as_settings
from martths_jax.campaign.fields import FIELDS, SECTIONS
from martths_jax.campaign.files import write_text
from martths_jax.control.controllers import ENTRIES
from martths_jax.control.entry import Entry
from martths_jax.errors import InputError

_HEAD = """\
# A study for `martths study --config {name}`.  Lines that begin with "# name =" show settings
# that have no value by default.
"""


def toml_value(value) -> str:
    """A setting in TOML."""
    if isinstance(value, (bool, str)):
        return json.dumps(value, ensure_ascii=False)  # a JSON string is a TOML string
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(map(toml_value, value)) + "]"
    return repr(float(value)) if isinstance(value, (float, np.floating)) else str(value)


def _section(name: str, settings: dict, comments: bool) -> str:
    lines = [f"[{name}]"]
    for field in FIELDS:
        if field.section != name:
            continue
        if comments:
            lines.append(f"# {field.help}")
        value = settings[field.name]
        if value is not None:
            lines.append(f"{field.name} = {toml_value(value)}")
        elif comments:
            lines.append(f"# {field.name} =")
    return "\n".join(lines) + "\n"


def _tables(controllers: dict[str, dict]) -> list[str]:
    found = []
    for name, settings in controllers.items():
        lines = [f"[controller.{toml_key(name)}]"]
        lines += [f"{k} = {toml_value(v)}" for k, v in settings.items() if v is not None]
        found.append("\n".join(lines) + "\n")
    return found


def toml_key(name: str) -> str:
    """A name as a TOML key, quoted where it must be."""
    bare = name.replace("-", "").replace("_", "")
    return name if bare.isalnum() and bare.isascii() else json.dumps(name)


def template(name: str = "study.toml") -> str:
    """A commented configuration with all defaults."""
    settings = as_settings(StudyConfig())
    sections = [_section(s, settings, comments=True) for s in SECTIONS]
    used = [entry for entry in ENTRIES if entry.name in settings["controllers"]]
    note = (
        "# Settings of the controllers; a new name says its kind too, one of ours or a class:\n"
        f'# kind = "{used[-1].name}", "package.module:Class" or "path/file.py:Class" (whose code '
        "is run).\n"
    )
    tables = "\n".join(map(_commented, used))
    return "\n".join([_HEAD.format(name=name), *sections, note + tables])


def _commented(entry: Entry) -> str:
    """Table of an entry's defaults, each with what it means."""
    lines = [f"[controller.{toml_key(entry.name)}]"]
    for p in entry.parameters:
        meaning = f"# {p.name}: {p.title}; must {p.wanted}"
        lines += [meaning] + [f"{p.name} = {toml_value(p.default)}"] * (p.default is not None)
    return "\n".join(lines) + "\n"


def write_template(path: Path, overwrite: bool = False) -> None:
    """Write the commented configuration.

    Raises:
        InputError: if the file exists already or cannot be written.
    """
    if path.exists() and not overwrite:
        raise InputError(f"{path} exists already; give another name, or `overwrite` (--force).")
    write_text(path, template(path.name))


def write_config(settings: dict, path: Path, remark: str = "") -> None:
    """The effective configuration of a run, to be read back by ``--config``, below a comment."""
    head = "".join(f"# {line}\n" for line in remark.splitlines())
    blank = {field.name: None for field in FIELDS}
    sections = [_section(s, blank | settings, comments=False) for s in SECTIONS]
    write_text(path, head + "\n".join([*sections, *_tables(settings["controller"])]))
