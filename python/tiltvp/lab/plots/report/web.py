"""Figures 17, 21, 22, 24, 25 and 28 to be touched: data and layout for plotly's script, which draws in a browser."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from tiltvp.lab.plots.report.normals import ARROW_LENGTH, NormalPanel
from tiltvp.lab.plots.report.style import ESTIMATE_COLOUR, Look, by_correction, looks
from tiltvp.lab.plots.report.times import points_shown

if TYPE_CHECKING:
    import polars as pl
    from numpy.typing import NDArray

    WebFigure = dict[str, Any]

__all__ = [
    "cumulative_errors_web", "errors_by_tilt_web", "errors_over_time_web", "normal_panels_web",
    "true_and_estimated_web",
]  # fmt: skip

_DIGITS = 5


def cumulative_errors_web(table: pl.DataFrame, *, error_max_deg: float = 5.0) -> WebFigure:
    """Figure 21, of the same table as `cumulative_errors`."""
    data = []
    for variant, look in looks(table["variant"]).items():
        part = table.filter(table["variant"] == variant)["error_rad"]
        errors = np.sort(np.degrees(part.drop_nulls().to_numpy()))
        share = 100.0 * np.arange(1, len(errors) + 1) / max(len(part), 1)
        data.append(
            _lines(variant, look, np.concatenate([[0.0], errors]), np.concatenate([[0.0], share]))
            | {"mode": "lines", "hovertemplate": "%{y:.1f} % of images<br>ε ≤ %{x:.2f}°<extra>%{fullData.name}</extra>"}
        )
        data[-1]["line"]["shape"] = "hv"
    layout = _layout("error ε′ (degrees)", "images with ε ≤ ε′ (%)")
    layout["xaxis"]["range"], layout["yaxis"]["range"] = [0.0, error_max_deg], [0.0, 100.5]
    return {"data": data, "layout": layout}


def errors_by_tilt_web(table: pl.DataFrame, overall: pl.DataFrame) -> WebFigure:
    """Figure 22, of the same tables as `errors_by_tilt`."""
    data = []
    means = dict(overall.select("variant", "mean_deg").iter_rows())
    for variant, look in looks(overall["variant"]).items():
        part = table.filter(table["variant"] == variant).sort("alpha_true_deg")
        x = part["alpha_true_deg"].to_numpy()
        words = "α<sub>T</sub> = %{x:.2f}°: mean ε = %{y:.3f}°<br>%{customdata} images<extra>%{fullData.name}</extra>"
        line = _lines(variant, look, x, part["mean_deg"].to_numpy())
        data.append(line | {"customdata": part["images"].to_list(), "hovertemplate": words})
        if len(x):
            level = _lines(variant, look, x[[0, -1]], np.full(2, means[variant]))
            words = "all images: %{y:.3f}°<extra>%{fullData.name}</extra>"
            data.append(level | {"mode": "lines", "opacity": 0.45, "showlegend": False, "hovertemplate": words})
            data[-1]["line"]["width"] = 1
    layout = _layout("true tilt α<sub>T</sub> (degrees)", "mean error (degrees)")
    layout["yaxis"]["rangemode"] = "tozero"
    return {"data": data, "layout": layout}


def errors_over_time_web(table: pl.DataFrame, *, error_max_deg: float = 3.0) -> WebFigure:
    """Figures 24 and 25, of the same table as `errors_over_time` with `label`, the combination in words."""
    shown = points_shown(table, error_max_deg=error_max_deg)
    data: list[dict[str, Any]] = []
    for best in (False, True):
        for variant, look in looks(table["variant"]).items():
            part = shown.filter((shown["variant"] == variant) & (shown["best"] == best))
            marker: dict[str, Any] = {"color": look.colour, "symbol": look.web_marker, "size": 14 if best else 8}
            marker |= {"line": {"color": "black", "width": 2}} if best else {"opacity": 0.6}
            data.append(
                {
                    "type": "scatter", "mode": "markers", "name": variant, "legendgroup": variant, "marker": marker,
                    "showlegend": best,
                    "x": _rounded(part["time_mean_ms"].to_numpy()), "y": _rounded(part["mean_deg"].to_numpy()),
                    "text": part["label"].to_list(),
                    "hovertemplate": "%{text}<br>%{y:.3f}°, %{x:.3f} ms<extra>%{fullData.name}</extra>",
                }
            )  # fmt: skip
    layout = _layout("mean time (ms)", "mean error (degrees)")
    layout["xaxis"]["rangemode"] = layout["yaxis"]["rangemode"] = "tozero"
    layout["hovermode"] = "closest"
    return {"data": data, "layout": layout}


def true_and_estimated_web(table: pl.DataFrame) -> WebFigure:
    """Figure 28, of the same table as `true_and_estimated` with `p05_deg` and `p95_deg`."""
    data = []
    for label, look, raw, part in by_correction(table):
        line = _lines(label, look, part["alpha_true_deg"].to_numpy(), part["alpha_deg"].to_numpy())
        line["line"]["dash"] = "dash" if raw else "solid"
        if raw:
            line["marker"]["symbol"] = f"{look.web_marker}-open"
        line["customdata"] = [_rounded(row) for row in part.select("p05_deg", "p95_deg").to_numpy()]
        line["hovertemplate"] = (
            "α<sub>T</sub> = %{x:.2f}°: mean α = %{y:.2f}°<br>"
            "5 % to 95 %: %{customdata[0]:.2f}° to %{customdata[1]:.2f}°<extra>%{fullData.name}</extra>"
        )
        data.append(line)
    most = max(table["alpha_true_deg"].to_list(), default=0.0)
    data.append(
        {
            "type": "scatter", "mode": "lines", "name": "estimate = truth", "x": [0.0, most], "y": [0.0, most],
            "line": {"color": "black", "width": 1}, "hoverinfo": "skip",
        }
    )  # fmt: skip
    layout = _layout("true tilt α<sub>T</sub> (degrees)", "mean estimated tilt α (degrees)")
    layout["yaxis"]["rangemode"] = "tozero"
    layout["height"] = 540
    return {"data": data, "layout": layout}


def normal_panels_web(panels: Sequence[NormalPanel]) -> WebFigure:
    """Figure 17: the panels beside each other as scenes that turn under the pointer."""
    data: list[dict[str, Any]] = []
    layout: dict[str, Any] = {"showlegend": False, "height": 480, "margin": {"l": 0, "r": 0, "t": 30, "b": 0}}
    layout["annotations"] = []
    for i, panel in enumerate(panels):
        scene = "scene" if i == 0 else f"scene{i + 1}"
        tips = panel.bearings + ARROW_LENGTH * panel.normals
        gap = np.full_like(tips, np.nan)
        lines = np.stack([panel.bearings, tips, gap], axis=1).reshape(-1, 3)
        common = {"type": "scatter3d", "scene": scene, "hoverinfo": "skip"}
        data.append(common | _places(lines) | {"mode": "lines", "line": {"color": ESTIMATE_COLOUR, "width": 3}})
        dots = {"mode": "markers", "marker": {"color": ESTIMATE_COLOUR, "size": 2.2, "symbol": "diamond"}}
        data.append(common | _places(tips) | dots)
        axis = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 1.25]])
        black = {"mode": "lines", "line": {"color": "black", "width": 5}}
        data.append(common | _places(axis) | black)
        titles = zip("xyz", ("x, forward", "y, left", "z, up"), strict=True)
        layout[scene] = {
            **{f"{name}axis": {"title": {"text": title}, "nticks": 4} for name, title in titles},
            "aspectmode": "data",
            "camera": {"eye": {"x": 1.25, "y": -1.85, "z": 1.05}, "center": {"x": 0.0, "y": 0.0, "z": -0.12}},
            "dragmode": "turntable",
            "domain": {"x": [i / len(panels), (i + 1) / len(panels)], "y": [0.0, 1.0]},
        }
        place = {"x": (i + 0.5) / len(panels), "y": 1.0, "xref": "paper", "yref": "paper", "yanchor": "bottom"}
        layout["annotations"].append(place | {"text": panel.title, "showarrow": False})
    return {"data": data, "layout": layout}


def _lines(name: str, look: Look, x: NDArray[np.float64], y: NDArray[np.float64]) -> dict[str, Any]:
    return {
        "type": "scatter", "mode": "lines+markers", "name": name, "legendgroup": name,
        "x": _rounded(x), "y": _rounded(y),
        "line": {"color": look.colour, "dash": look.web_line, "width": 2},
        "marker": {"color": look.colour, "symbol": look.web_marker, "size": 8},
    }  # fmt: skip


def _layout(x: str, y: str) -> dict[str, Any]:
    axis = {"showgrid": True, "gridcolor": "#e5e5e5", "zeroline": False, "linecolor": "#333", "ticks": "outside"}
    return {
        "height": 460,
        "margin": {"l": 60, "r": 20, "t": 10, "b": 50},
        "hovermode": "closest",
        "legend": {"orientation": "h", "yanchor": "bottom", "y": 1.01, "x": 0.0},
        "xaxis": axis | {"title": {"text": x}},
        "yaxis": axis | {"title": {"text": y}},
    }


def _places(points: NDArray[np.float64]) -> dict[str, list[float | None]]:
    return {name: _rounded(points[:, i]) for i, name in enumerate("xyz")}


def _rounded(values: NDArray[np.float64]) -> list[float | None]:
    """Numbers for JSON, with as many digits as a picture can show; null for NaN, which JSON has not."""
    return [round(float(value), _DIGITS) if np.isfinite(value) else None for value in values]
