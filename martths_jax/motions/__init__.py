"""Ground motions: names and files in, `Motion` out."""

from __future__ import annotations

from .load import DEFAULT_SCALE, load_motion, load_record
from .motion import Motion
from .record import Record

__all__ = ["DEFAULT_SCALE", "Motion", "Record", "load_motion", "load_record"]
