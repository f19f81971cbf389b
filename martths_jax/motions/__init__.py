"""Ground motions: built-in ones, files, scaling, sampling, intensity measures and spectra."""

from __future__ import annotations

from .builtin import BUILTIN_NAMES, ensemble
from .export import write_csv, write_ensemble
from .load import DEFAULT_SCALE, load_motion, load_record
from .measures import (
    arias_intensity,
    cumulative_absolute_velocity,
    ground_velocity,
    husid,
    intensity_measures,
    peak_ground_acceleration,
    peak_ground_velocity,
    significant_duration,
    spectral_acceleration,
)
from .motion import Motion
from .overview import MotionInfo, available_motions, motion_info
from .record import Record
from .spectra import response_spectrum, sdof_response

__all__ = [
    "BUILTIN_NAMES",
    "DEFAULT_SCALE",
    "Motion",
    "MotionInfo",
    "Record",
    "arias_intensity",
    "available_motions",
    "cumulative_absolute_velocity",
    "ensemble",
    "ground_velocity",
    "husid",
    "intensity_measures",
    "load_motion",
    "load_record",
    "motion_info",
    "peak_ground_acceleration",
    "peak_ground_velocity",
    "response_spectrum",
    "sdof_response",
    "significant_duration",
    "spectral_acceleration",
    "write_csv",
    "write_ensemble",
]
