"""Checksums: results and headers that know their own content, so that no bit changes unsaid.

HDF5 checks nothing by default, and its own checksums cover arrays only.  Here a digest over every
name, dimension, type, value and attribute stands in the file as an attribute, so it travels along.
"""

from __future__ import annotations

import hashlib
import json

import numpy as np
import xarray as xr

#: The attribute that holds ``content_digest``.
CHECKSUM = "content_sha256"


def json_digest(content) -> str:
    """SHA-256 of what JSON can hold, whatever the order of its keys."""
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def content_digest(dataset: xr.Dataset) -> str:
    """SHA-256 of what a reader sees of a dataset, however text and numbers are stored."""
    digest = hashlib.sha256()

    def add(*words) -> None:
        for word in words:
            content = word if isinstance(word, bytes) else str(word).encode()
            digest.update(f"{len(content)}:".encode() + content)

    add(*_attributes(dataset.attrs))
    for name in sorted(dataset.variables):
        variable = dataset.variables[name]
        values = np.asarray(variable.values)
        add(name, variable.dims, values.shape, *_attributes(variable.attrs))
        if values.dtype.kind in "fiub":
            little = values.dtype.newbyteorder("<")
            add(little.str, np.ascontiguousarray(values, dtype=little).tobytes())
        else:
            add("text", *map(str, values.ravel().tolist()))
    return digest.hexdigest()


def _attributes(attributes: dict) -> list[str]:
    found = []
    for name in sorted(attributes):
        if name != CHECKSUM:
            value = attributes[name]
            value = value.decode() if isinstance(value, bytes) else value
            plain = value if isinstance(value, str) else np.ravel(value).tolist()
            found += [name, repr(plain)]
    return found
