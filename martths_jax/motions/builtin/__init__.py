"""Ground motions that come with the package."""

from __future__ import annotations

BUILTIN_NAMES = ()
