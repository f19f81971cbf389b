"""A study to look through: tables for papers, one HTML file to browse, trials run again.

`tables` and `render` make the tables, `page` the HTML file, `replay` runs a trial again.
"""

from martths_jax.report.page import write_report
from martths_jax.report.replay import replay
from martths_jax.report.tables import FORMATS, render, study_tables

__all__ = ["FORMATS", "render", "replay", "study_tables", "write_report"]
