"""Tools that some tests need: without one they skip, but not in continuous integration."""

from __future__ import annotations

import os
from typing import NoReturn

import pytest


def missing(what: str, remedy: str) -> NoReturn:
    """Skip the test for want of a tool; fail it where ``CI`` is set, whose task it is to have it.

    Args:
        what: is missing, as "no Chromium was found".
        remedy: how to get it.
    """
    if os.environ.get("CI", "").lower() not in ("", "0", "false"):
        pytest.fail(f"{what}, and CI is set: {remedy}", pytrace=False)
    pytest.skip(f"{what}; {remedy}")
