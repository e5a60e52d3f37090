"""How far the estimates' own words can be trusted: shares, alarms and halves on draws of known law, and the command."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import polars as pl
import pytest

from evaluations import evaluated
from tiltvp.cli import main
from tiltvp.lab.datasets.folder import TiltDataset
from tiltvp.lab.evaluation.trust import TOGETHER, trust, was_set_on


def draws(seed: int, promised: float = 1.0) -> pl.DataFrame:
    """400 estimates with normal errors of 0.2 to 2 degrees, whose covariances are `promised` times the true ones."""
    rng = np.random.default_rng(seed)
    sigma = np.deg2rad(rng.uniform(0.2, 2.0, 400))
    errors = rng.normal(0.0, 1.0, (400, 2)) * sigma[:, None]
    return pl.DataFrame(
        {
            "variant": "refined",
            "image": np.arange(400, dtype=np.uint32),
            "location": [f"place {k // 4}" for k in range(400)],
            "environment": [f"building {k // 8}" for k in range(400)],
            "yaw_rad": np.zeros(400),
            "error_rad": np.linalg.norm(errors, axis=1),
            "offset_x_rad": errors[:, 0],
            "offset_y_rad": errors[:, 1],
            "covariance_xx_rad2": promised * sigma**2,
            "covariance_xy_rad2": np.zeros(400),
            "covariance_yy_rad2": promised * sigma**2,
            "confidence": 1.0 - np.exp(-0.5 * (np.deg2rad(2.0) / sigma) ** 2),
        }
    )


def test_honest_covariances_hold_what_they_promise_and_others_do_not() -> None:
    table = trust({"honest": draws(1), "vain": draws(1, promised=0.1)})
    assert table["run"].to_list() == ["honest", "vain", TOGETHER]
    honest, vain, together = table.iter_rows(named=True)
    # With about 200 draws in each half a share errs by 0.035 at most; three of those leave a false alarm in 300.
    for half in ("set", "held"):
        for level in (50, 90, 95):
            assert honest[f"{half}_{level}"] == pytest.approx(level / 100.0, abs=0.11)
            assert vain[f"{half}_{level}"] < level / 100.0 - 0.2
    assert 0.8 < honest["roc_area"] < 1.0
    assert together["images"] == 800
    assert together["failures"] == 2 * honest["failures"] > 0


def test_an_alarm_that_knows_and_one_that_cannot_ring() -> None:
    rows = draws(2)
    knowing = trust({"run": rows.with_columns(confidence=1.0 - pl.col("error_rad"))}).row(0, named=True)
    assert knowing["roc_area"] == pytest.approx(1.0)
    accepted = np.sort(np.rad2deg(rows["error_rad"].to_numpy()))[:360]
    assert knowing["accepted_p99_deg"] == pytest.approx(np.percentile(accepted, 99))
    # What knows the failures of the buildings alone that it was set on.
    on = pl.col("environment").map_elements(was_set_on, return_dtype=pl.Boolean)
    told = pl.when(on).then(1.0 - pl.col("error_rad")).otherwise(pl.col("error_rad"))
    memory = trust({"run": rows.with_columns(confidence=told)}).row(0, named=True)
    assert memory["held_roc_area"] == pytest.approx(0.0)
    assert memory["roc_area"] > 0.2
    never = trust({"run": rows.with_columns(error_rad=0.1 * pl.col("error_rad"))}).row(0, named=True)
    assert never["failures"] == 0
    assert never["roc_area"] is None


def test_halves_are_of_locations() -> None:
    halves = [was_set_on(f"place {k}") for k in range(400)]
    assert 150 < sum(halves) < 250
    assert halves == [was_set_on(f"place {k}") for k in range(400)]


def test_the_command(tmp_path: Path, dataset: TiltDataset, capfd: pytest.CaptureFixture[str]) -> None:
    run = tmp_path / "rooms"
    evaluated(dataset, run)
    out = tmp_path / "trust.csv"
    assert main(["measure", "confidence", str(run), "--out", str(out)]) == 0
    assert "refined" in capfd.readouterr().out
    assert "refined" in pl.read_csv(out)["variant"].to_list()
    assert main(["measure", "confidence", str(run), str(run)]) == 2
    assert "expected runs with names of their own" in capfd.readouterr().err
