"""Cameras see bearings of any length."""

from __future__ import annotations

import numpy as np
import pytest

from test_cameras import CAMERAS, rays


@pytest.mark.parametrize("length", [1e-310, 1e-200, 1e-100, 1e100, 1e200, 1e307])
@pytest.mark.parametrize("key", CAMERAS)
def test_bearings_may_be_of_any_length(key: str, length: float) -> None:
    camera, bearings = CAMERAS[key], rays(120.0, 40)
    expected, by_unit = camera.project_jacobian(bearings)
    np.testing.assert_allclose(camera.project(bearings * length), expected, rtol=0.0, atol=1e-6)
    pixels, jacobians = camera.project_jacobian(bearings * length)
    np.testing.assert_allclose(pixels, expected, rtol=0.0, atol=1e-6)
    if length > 1e-300:  # Below, derivatives are beyond floats.
        np.testing.assert_allclose(jacobians * length, by_unit, rtol=1e-6, atol=1e-6)
