"""What is learned of choices: which of several things is the right one."""

from __future__ import annotations

import numpy as np

from tiltvp.lab.evaluation.choices import EXPECTED, Network, choice_shares, train_network, train_weights

FEATURES = 6
TOLD = 4


def choices(seed: int, count: int) -> list[tuple[np.ndarray, int]]:
    """Of three things the one whose feature `TOLD` is nearest to zero is the right one: no line tells it."""
    rng = np.random.default_rng(seed)
    drawn = rng.normal(size=(count, 3, FEATURES))
    return [(features, int(np.abs(features[:, TOLD]).argmin())) for features in drawn]


def right(network: Network, told: list[tuple[np.ndarray, int]]) -> float:
    """The share of choices that it gets right."""
    return float(np.mean([network.log_odds(features).argmax() == number for features, number in told]))


def test_a_network_learns_what_no_line_tells() -> None:
    told, others = choices(1, 600), choices(2, 400)
    network = train_network(told)
    assert right(network, others) > 0.85
    line = train_weights(told, 5.0)
    assert np.mean([(features @ line).argmax() == number for features, number in others]) < 0.5


def test_the_same_choices_make_the_same_network() -> None:
    told = choices(3, 100)
    assert train_network(told).rust() == train_network(told).rust()


def test_what_was_expected_counts_in_proportion() -> None:
    network = train_network(choices(4, 200))
    rows = np.tile(network.means, (3, 1))
    rows[:, EXPECTED[0]] += np.array([0.0, 10.0, 20.0]) * network.scales[EXPECTED[0]]
    low, middle, high = network.log_odds(rows)
    assert np.isclose(high - middle, middle - low, atol=1e-12)
    rows = np.tile(network.means, (2, 1))
    rows[:, TOLD] += np.array([50.0, 500.0]) * network.scales[TOLD]
    assert np.ptp(network.log_odds(rows)) == 0.0


def test_shares_are_probabilities() -> None:
    shares = choice_shares(np.array([1000.0, 999.0, -1000.0]))
    assert np.isclose(shares.sum(), 1.0)
    assert np.isclose(shares[0] / shares[1], np.e)
