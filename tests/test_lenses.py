"""Lenses: every way to make a camera accepts and refuses the same, with the sentence of the core."""

from __future__ import annotations

import inspect
import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import tomli_w

import tiltvp
from tiltvp import _core
from tiltvp.errors import TiltvpError
from tiltvp.lenses import stub

ROOT = Path(__file__).parents[1]
SIZE = {"width": 64, "height": 48}
MODELS = _core.CAMERA_MODELS


def declared(model: str) -> list[dict[str, Any]]:
    """The parameters that the core declares for a lens."""
    return _core.lens_schema(model)["parameters"]


def example(model: str) -> dict[str, Any]:
    """Parameters that the lens takes: the same number everywhere."""
    return {one["name"]: [0.5] if one["is_list"] else 0.5 for one in declared(model)}


def by_name(model: str, parameters: dict[str, Any], folder: Path) -> tiltvp.Camera:
    return tiltvp.Camera(model, **SIZE, **parameters)


def by_constructor(model: str, parameters: dict[str, Any], folder: Path) -> tiltvp.Camera:
    return getattr(tiltvp.Camera, model)(**SIZE, **parameters)


def by_file(model: str, parameters: dict[str, Any], folder: Path) -> tiltvp.Camera:
    path = folder / "camera.toml"
    camera = {"model": model, **SIZE, "parameters": parameters}
    path.write_text(tomli_w.dumps({"format": "tiltvp-camera", "version": 1, "camera": [camera]}))
    return tiltvp.Camera.load(path)


def outcome(make: Callable[..., tiltvp.Camera], *arguments: Any) -> tiltvp.Camera | str:
    """The camera, or the sentence that refuses it without what a file adds: its path and the place in it."""
    try:
        return make(*arguments)
    except TiltvpError as error:
        return re.sub(r"^\S*camera\.toml: |, at camera\[0\]\.parameters$", "", str(error))


def changes(model: str) -> list[dict[str, Any]]:
    """Parameters right and wrong: each one missing, not a number, infinite, huge, negative, of the other kind."""
    whole = example(model)
    found = [whole, whole | {"strange": 1.0}]
    for one in declared(model):
        name = one["name"]
        found.append({key: value for key, value in whole.items() if key != name})
        numbers = (math.nan, math.inf, 1e300, -3.0, 0.0, 1)
        found += [whole | {name: [number] if one["is_list"] else number} for number in numbers]
        found += [whole | {name: wrong} for wrong in (0.5 if one["is_list"] else [0.5], "long", True, [], [[0.5]])]
    return found


@pytest.mark.parametrize("model", MODELS)
def test_all_ways_accept_and_refuse_the_same(model: str, tmp_path: Path) -> None:
    accepted = refused = 0
    for parameters in changes(model):
        named = outcome(by_name, model, parameters, tmp_path)
        assert outcome(by_constructor, model, parameters, tmp_path) == named
        assert outcome(by_file, model, parameters, tmp_path) == named
        accepted += isinstance(named, tiltvp.Camera)
        refused += isinstance(named, str)
        assert isinstance(named, tiltvp.Camera) or "expected" in named
    assert accepted >= 1
    assert refused >= 1


@pytest.mark.parametrize("model", MODELS)
def test_what_may_be_left_away_has_its_default(model: str) -> None:
    required = {name: value for name, value in example(model).items() if name in needed(model)}
    defaults = {one["name"]: one["default"] for one in declared(model) if not one["required"]}
    assert tiltvp.Camera(model, **SIZE, **required).parameters == required | defaults
    assert list(tiltvp.Camera(model, **SIZE, **required).parameters) == [one["name"] for one in declared(model)]
    assert tiltvp.Camera(model, **SIZE, **required, **dict.fromkeys(defaults)).parameters == required | defaults


def needed(model: str) -> set[str]:
    return {one["name"] for one in declared(model) if one["required"]}


@pytest.mark.parametrize("model", MODELS)
def test_every_model_has_a_constructor(model: str) -> None:
    make = getattr(tiltvp.Camera, model)
    keywords = inspect.signature(make).parameters
    assert list(keywords) == ["width", "height", *example(model), "max_theta_rad", "mirror"]
    assert all(one.kind is inspect.Parameter.KEYWORD_ONLY for one in keywords.values())
    assert {name for name, one in keywords.items() if one.default is inspect.Parameter.empty} == {*SIZE, *needed(model)}
    assert all(f"{one['name']}: {one['doc']}" in make.__doc__ for one in declared(model))


def test_the_stub_of_the_constructors_is_what_just_stub_writes() -> None:
    assert (ROOT / "python/tiltvp/lenses.pyi").read_text() == stub()


def test_the_guide_lists_the_parameters() -> None:
    rows = re.findall(r"^\| `(\w+)` \|([^|]*)\|", (ROOT / "docs/cameras.md").read_text(), re.MULTILINE)
    assert [name for name, _ in rows] == MODELS
    for model, cell in rows:
        required, _, optional = cell.strip().partition("[")
        assert required.split() == [one["name"] for one in declared(model) if one["required"]], model
        assert optional.rstrip("]").split() == [one["name"] for one in declared(model) if not one["required"]], model
