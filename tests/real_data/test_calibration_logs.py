"""Self-calibration on real logs: the mounting within what is known of it."""

from __future__ import annotations

from pathlib import Path

import pytest

from tiltvp.lab.evaluation.calibration import real_logs


@pytest.fixture(scope="module")
def rows(data: Path) -> dict[tuple[str, str], dict[str, float]]:
    return {(row["log"], row["by"]): row for row in real_logs(data / "odometry", only="lego").iter_rows(named=True)}


@pytest.mark.parametrize("by", ["filter", "whole log"])
def test_the_lego_robot(rows: dict[tuple[str, str], dict[str, float]], by: str) -> None:
    row = rows["brenner_lego from (0.0, 0.0, 0.0)", by]
    assert abs(row["x error mm"]) < 10.0
    assert abs(row["yaw error deg"]) < 1.0
