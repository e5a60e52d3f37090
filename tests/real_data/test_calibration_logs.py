"""Self-calibration on real logs: the mounting within what is known of it, and where the kept run has it."""

from __future__ import annotations

from pathlib import Path

import pytest

from measured import RUNS
from tiltvp.lab.evaluation.calibration import LOG_PARTS, read_logs, real_logs


@pytest.fixture(scope="module")
def rows(data: Path) -> dict[tuple[str, str], dict[str, float]]:
    return {(row["log"], row["by"]): row for row in real_logs(read_logs(data / "odometry")).iter_rows(named=True)}


@pytest.mark.parametrize("by", ["filter", "whole log"])
def test_the_lego_robot(rows: dict[tuple[str, str], dict[str, float]], by: str) -> None:
    row = rows["brenner_lego from (0.0, 0.0, 0.0)", by]
    assert abs(row["x error mm"]) < 10.0
    assert abs(row["yaw error deg"]) < 1.0


def test_logs_end_where_the_kept_run_has_them(rows: dict[tuple[str, str], dict[str, float]]) -> None:
    # The hash of a kept run is of answers to simulated drives.
    kept = [line.strip() for line in (RUNS / "measure-calibration.txt").read_text(encoding="utf-8").splitlines()]
    assert len(rows) == LOG_PARTS * 6
    for (log, by), row in rows.items():
        parts = [line.removeprefix(log).strip() for line in kept if line.startswith(log)]
        numbers = next(part.removeprefix(by).split() for part in parts if part.removeprefix(by)[:3] == "   ")
        for number, axis in zip(numbers, ("x error mm", "y error mm", "yaw error deg"), strict=False):
            sigma = row["sigma " + axis.split()[0]]
            assert float(number) == pytest.approx(row[axis], abs=0.1 * sigma + 0.001), (log, by, axis)
