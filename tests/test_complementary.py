"""The complementary filter of attitudes: what it refuses leaves it as it was."""

from __future__ import annotations

import copy
import pickle

import numpy as np
import pytest

import tiltvp
from tiltvp.errors import InvalidInputError


@pytest.mark.parametrize(("rate", "duration_s"), [(1e200, 0.1), (1e300, 1e300), (0.0, 1e308)])
def test_a_turn_that_is_no_number_leaves_the_filter_as_it_was(rate: float, duration_s: float) -> None:
    fusion = tiltvp.ComplementaryFilter(np.eye(3))
    fusion.predict(np.zeros(3), 1e308 if rate == 0.0 else 0.5)
    before = copy.copy(fusion)
    with pytest.raises(InvalidInputError, match="rate_rad_s, duration_s"):
        fusion.predict([rate, 0.0, 0.0], duration_s)
    assert fusion == before == pickle.loads(pickle.dumps(fusion))
