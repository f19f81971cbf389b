"""The result file: one NetCDF-4 file that xarray, MATLAB's ``ncread`` and plain HDF5 tools read.

Text is stored as fixed-length characters and attributes as fixed-length text, since older readers
know neither variable-length strings nor booleans.  Both are marked as UTF-8: whoever knows the mark
(xarray, netCDF4) gives text and not bytes.  Nothing in the file depends on when, in how many
sessions or on how many devices it was computed: that is in ``provenance.json``.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Sequence
from pathlib import Path

import h5netcdf
import h5py
import numpy as np
import xarray as xr

from martths_jax.campaign.checksum import CHECKSUM, content_digest
from martths_jax.campaign.engine import FIRSTS, Outcome
from martths_jax.campaign.files import writing
from martths_jax.campaign.store import FORMAT, RunFolder
from martths_jax.errors import InputError
from martths_jax.files import forgiving
from martths_jax.guests import kept
from martths_jax.problem import Problem, find_problem
from martths_jax.watch import Status

INDEX_UNITS = {"units": "see the variable `unit`; delays: positive = late"}
#: Units as files spell them.
SPELT = {"%": "percent", "mm²": "mm2"}
#: What the numbers of a status mean, by the conventions of NetCDF.
STATUS_FLAGS = {
    "flag_values": np.array([int(s) for s in Status], dtype=np.int32),
    "flag_meanings": " ".join(s.name.lower() for s in Status),
}
#: What says that characters are text, by the conventions of NetCDF.
ENCODING = {"_Encoding": "utf-8"}
#: Longest attribute HDF5 stores in an object's header [bytes].
LONGEST_ATTRIBUTE = 60_000
#: Where a dataset's ``encoding`` says what folder it is of.
FOLDER = "folder"
#: Problem and case in what identifies a run; they stand near its beginning, before all lists.
_PROBLEM = re.compile(r'"problem": (?P<name>"[^"]*"), "case": (?P<case>null|\d+)')
_FIRST_WORDS = {
    "saturated": "valve command beyond its limit",
    "command": "command beyond its range or not a number",
    "stroke": "measured stroke beyond its range or not a number",
    "nonfinite": "measured stroke not finite",
}


def outcome_variables(
    identity: dict,
    dims: Sequence[str],
    gather: Callable[[Callable[[Outcome], np.ndarray]], np.ndarray],
) -> dict:
    """Variables that the results of every campaign have: what became of each run.

    Args:
        identity: of the run.
        dims: of a run: dimensions of the cells, then of their rows.
        gather: puts an array of each cell's ``Outcome``, (rows, ...), together over all cells.
    """
    cell = tuple(dims)
    variables = {
        "value": ((*cell, "index"), gather(lambda o: o.value), {
            "long_name": "evaluation indices; NaN where there is none, see status"} | INDEX_UNITS),
        "status": (cell, gather(lambda o: o.status), {
            "long_name": "how the trial ended"} | STATUS_FLAGS),
        "volt_peak": ((*cell, "actuator"), gather(lambda o: o.volt_peak), {
            "long_name": "largest valve command", "units": "V"}),
    } | index_variables(identity) | count_variables(identity, cell, gather)  # fmt: skip
    for i, name in enumerate(FIRSTS):
        variables[f"first_{name}"] = ((*cell, "actuator"), gather(lambda o, i=i: o.first[:, i]), {
            "long_name": f"first sample with {_FIRST_WORDS[name]}; NaN = never",
            "units": "samples"})  # fmt: skip
    return variables


def assemble(run: RunFolder, plants) -> xr.Dataset:
    """All results of a complete run.

    Args:
        run: the folder.
        plants: of trials 0 ... N.

    Raises:
        InputError: trials are missing, or a part is damaged.
    """
    identity = run.header["identity"]
    controllers, motions = identity["controllers"], identity["motions"]
    cells = [[run.read(c, m) for m in motions] for c in controllers]

    def gather(pick):
        return np.stack([np.stack([pick(outcome) for outcome in row]) for row in cells])

    cell = ("controller", "motion", "trial")
    variables = outcome_variables(identity, cell, gather) | {
        "draw": (("trial", "parameter"), np.asarray(plants.draws), {
            "long_name": "standard normal draws of the plant", "units": "1"}),
        run.problem.stored[0]: (("trial", "parameter"), np.asarray(plants.values), dict(
            zip(("long_name", "units"), run.problem.stored[1:], strict=True))),
    }  # fmt: skip
    variables |= _motion_variables(identity)
    coordinates = {
        "controller": np.array(controllers),
        "motion": np.array(motions),
        "trial": np.arange(run.trials + 1, dtype=np.int32),
        "index": np.array(identity["indices"]),
        "actuator": places(run.problem.layout.actuators),
        "parameter": np.array(run.problem.parameters),
    }
    return xr.Dataset(variables, coordinates, attributes(run))


def places(names: tuple[str, ...]) -> np.ndarray:
    """Names of actuators or degrees of freedom as a coordinate: numbers where all are numbers."""
    numbers = all(name.isdecimal() for name in names)
    return np.array(names, dtype=np.int32) if numbers else np.array(names)


def index_variables(identity: dict) -> dict:
    """What a result file says of each of its indices."""
    units = [identity["index"][name]["unit"] for name in identity["indices"]]
    spelt = np.array([SPELT.get(unit, unit) for unit in units])
    return {"unit": (("index",), spelt, {"long_name": "unit of each index"})}


def count_variables(identity: dict, cell: tuple[str, ...], gather) -> dict:
    """What the controllers counted; zeros where one does not count.

    Args:
        cell: dimensions; gather: calls a function of an outcome for all of them.
    """
    return {
        name: (cell, gather(lambda o, n=name: o.counts.get(n, np.zeros_like(o.status))), {
            "long_name": words, "units": "1"})
        for name, words in identity["counts"].items()
    }  # fmt: skip


def index_names(dataset: xr.Dataset) -> list[str]:
    """Names of the indices in a result file, in its order."""
    return [str(name) for name in dataset["index"].values]


def unit_of(dataset: xr.Dataset, index: str) -> str:
    """Unit of an index in a result file, as tables and axes show it."""
    spelt = str(dataset.unit.sel(index=index).values)
    return next((unit for unit, words in SPELT.items() if words == spelt), spelt)


def units(dataset: xr.Dataset) -> dict[str, list[str]]:
    """Units in a result file -> the indices that have them, in its order."""
    found: dict[str, list[str]] = {}
    for name in index_names(dataset):
        found.setdefault(unit_of(dataset, name), []).append(name)
    return found


def _motion_variables(identity: dict) -> dict:
    about = [identity["motion"][name] for name in identity["motions"]]
    return {
        "samples": ("motion", np.array([m["samples"] for m in about], dtype=np.int32), {
            "long_name": "length of the motion", "units": "samples"}),
        "scale": ("motion", np.array([m["scale"] for m in about]), {
            "long_name": "factor on the unscaled record", "units": "1"}),
        "pga": ("motion", np.array([m["pga"] for m in about]), {
            "long_name": "peak ground acceleration as run", "units": "m s-2"}),
        "record_sha256": ("motion", np.array([m["sha256"] or "-" for m in about]), {
            "long_name": "SHA-256 of the record's file (of the samples of a built-in motion)"}),
    }  # fmt: skip


def attributes(run: RunFolder) -> dict:
    """Global attributes: everything that decides the numbers."""
    identity = run.header["identity"]
    versions = identity["versions"]
    records = "\n".join(f"{n} {identity['motion'][n]['sha256']}" for n in identity["motions"])
    found = {
        "title": f"{title_of(run.problem)}: Monte Carlo study",
        "Conventions": "CF-1.10",
        "format": FORMAT,
        **{f"version_{name}": text for name, text in versions.items()},
        "git_commit": ", ".join(c for c in run.header["commits"] if c) or "not a checkout",
        "platform": run.header["platform"],
        "controllers": json.dumps(run.header.get("controllers", {})),
        "machines": json.dumps(list(run.header["machines"].values())),
        "command_line": run.header["command_line"],
        "seed": int(identity["seed"]),
        "trials": int(run.trials),
        "fs": float(identity["fs"]),
        "configuration": json.dumps(run.header["config"]),
        "identity": json.dumps({k: v for k, v in identity.items() if k != "motion"}),
        "record_sha256": records,
        "provenance": "provenance.json beside this file: times, sessions, hosts, devices",
    }
    return {k: _shortened(v) if isinstance(v, str) else v for k, v in found.items()}


def title_of(problem: Problem) -> str:
    """A problem in the title of a result file."""
    return f"Virtual {problem.title.removesuffix(' benchmark')}"


def controllers_of(dataset: xr.Dataset) -> dict[str, dict]:
    """Of each controller in a result file: ``kind``, ``label``, ``look`` and ``paper``."""
    try:
        told = json.loads(dataset.attrs["controllers"])
    except (KeyError, ValueError):  # a very long list is stored shortened
        told = {}
    blank = lambda name: {"kind": name, "label": name, "look": None, "paper": ""}  # noqa: E731
    return {name: blank(name) | told.get(name, {}) for name in map(str, dataset.controller.values)}


def problem_of(dataset: xr.Dataset) -> Problem:
    """What results are about: the problem that was tested, by default the maRTHS benchmark.

    Args:
        dataset: of ``Results``, which know the folder that keeps a problem's own files.
    """
    found = _PROBLEM.search(str(dataset.attrs.get("identity", "")))
    if found is None:
        return find_problem()
    name = kept(json.loads(found["name"]), Path(dataset.encoding.get(FOLDER, ".")))
    return find_problem(name, None if found["case"] == "null" else int(found["case"]))


def _shortened(text: str) -> str:
    fits = len(text.encode()) <= LONGEST_ATTRIBUTE
    return text if fits else text[: LONGEST_ATTRIBUTE // 4] + " ... (see run.json)"


def write_dataset(dataset: xr.Dataset, path: Path, group: str | None = None) -> None:
    """Write a dataset into a file that is not yet in its place (see ``files.writing``)."""
    stored = dataset.copy()
    stored.attrs[CHECKSUM] = content_digest(dataset)
    for name, variable in stored.variables.items():
        attrs = variable.attrs
        if variable.dtype.kind == "U":
            text = np.char.encode(variable.values, "utf-8")
            variable, attrs = xr.Variable(variable.dims, text), attrs | ENCODING
        variable = variable.copy()
        variable.attrs = {k: _fixed(v) for k, v in attrs.items()}
        stored[name] = variable
    stored.attrs = {k: _fixed(v) for k, v in stored.attrs.items()}
    # No fill value beside NaN itself: nothing is missing, and a NaN is a trial that diverged.
    plain = {name: {"_FillValue": None} for name in stored.variables}
    with forgiving(path, "r+b" if group else "w+b") as file:
        with h5netcdf.File(file, "a" if group else "w") as root:
            store = xr.backends.H5NetCDFStore(root, group, mode="a")
            stored.dump_to_store(store, encoding=plain)


def _fixed(value):
    if not isinstance(value, str):
        return value
    content = value.encode()
    return np.array(content, dtype=h5py.string_dtype("utf-8", max(len(content), 1)))


def save_dataset(dataset: xr.Dataset, path: Path) -> None:
    """Write a result file whole or not at all.

    Raises:
        InputError: if the disk refuses.
    """
    with writing(path) as temporary:
        write_dataset(dataset, temporary)


def read_results(folder: Path | str, name: str, what: str) -> xr.Dataset:
    """The result file of a finished run; `what` it is called in the message.

    Raises:
        InputError: if there is none, or it is of another version.
    """
    path = Path(folder) / name
    if not path.is_file():
        raise InputError(f"{path} does not exist; give the folder of a finished {what}.")
    return read_dataset(path)


def read_dataset(path: Path, group: str | None = None) -> xr.Dataset:
    """A result file, or a group of one, in memory with its text as text.

    Raises:
        InputError: if it cannot be read, or is of another version.
    """
    try:
        with xr.open_dataset(path, engine="h5netcdf", group=group) as file:
            dataset = file.load()
    except Exception as error:  # a damaged file makes HDF5 and its readers raise nearly anything
        why = str(error).splitlines()[0][:120] if str(error) else repr(error)
        raise _damaged(path, why) from None
    for name, variable in dataset.variables.items():
        # Characters come as text, and as bytes from files that do not say their encoding.
        if variable.dtype.kind in "SO":
            text = variable.values
            text = np.char.decode(text, "utf-8") if text.dtype.kind == "S" else text.astype(str)
            dataset[name] = (variable.dims, text, variable.attrs)
    found = dataset.attrs.get("format", FORMAT if group else None)
    if found is None or int(np.ravel(found)[0]) != FORMAT:
        raise InputError(
            f"{path} has format {found}, this version reads format {FORMAT}; use the version that "
            "wrote it."
        )
    written = dataset.attrs.pop(CHECKSUM, None)
    if written is None:
        raise _damaged(path, "it has no checksum, or an earlier version wrote it")
    if written != content_digest(dataset):
        raise _damaged(path, "its content is not what its checksum says")
    return dataset


def _damaged(path: Path, why: str) -> InputError:
    return InputError(
        f"{path} is damaged ({why}); repeat the command that wrote it, which computes again what "
        "is missing and writes it anew."
    )
