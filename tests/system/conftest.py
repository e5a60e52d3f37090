"""The report of a small run, for the tests of this folder."""

from reports import report, run

__all__ = ["report", "run"]
