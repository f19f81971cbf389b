"""Output formats, one file each.

To add one, write a file like ``csv.py`` that defines a ``Format``, and name it in ``FORMATS``; from
there on it is an option of ``martths export``.
"""

from martths_jax.campaign.formats.base import Format
from martths_jax.campaign.formats.csv import CSV
from martths_jax.campaign.formats.mat import MAT
from martths_jax.campaign.formats.plants import PLANTS

FORMATS = (MAT, CSV, PLANTS)

__all__ = ["CSV", "FORMATS", "MAT", "PLANTS", "Format"]
