"""What is learned of choices: which of several things is the right one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tiltvp.lab.evaluation.choices import Network, choice_shares, train_network

FEATURES = 6
TOLD = 4
PAST = 2
"""A feature that goes past the hidden units."""


def trained(told: list[tuple[np.ndarray, int]], line_alone: tuple[int, ...] | None = (PAST,)) -> Network:
    return train_network(told, units=16, decay=0.01, line_alone=line_alone)


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
    network = trained(told)
    assert right(network, others) > 0.85
    without_units = replace(network, out=0.0 * network.out)
    assert right(without_units, others) < 0.5


def test_without_a_line_hidden_units_say_all() -> None:
    network = trained(choices(1, 600), None)
    assert not network.linear.any()
    assert right(network, choices(2, 400)) > 0.85
    written: dict[str, np.ndarray] = {}
    exec(network.python(), written)
    scaled = np.clip((network.means + network.scales - written["MEANS"]) / written["SCALES"], -4.0, 4.0)
    log_odds = np.tanh(scaled @ written["HIDDEN"].T + written["BIASES"]) @ written["OUT"]
    assert np.isclose(log_odds, network.log_odds((network.means + network.scales)[None])[0], atol=0.02)


def test_the_same_choices_make_the_same_network() -> None:
    told = choices(3, 100)
    assert trained(told).rust() == trained(told).rust()


def test_what_was_expected_counts_in_proportion() -> None:
    network = trained(choices(4, 200))
    rows = np.tile(network.means, (3, 1))
    rows[:, PAST] += np.array([0.0, 10.0, 20.0]) * network.scales[PAST]
    low, middle, high = network.log_odds(rows)
    assert np.isclose(high - middle, middle - low, atol=1e-12)
    rows = np.tile(network.means, (2, 1))
    rows[:, TOLD] += np.array([50.0, 500.0]) * network.scales[TOLD]
    assert np.ptp(network.log_odds(rows)) == 0.0


def test_shares_are_probabilities() -> None:
    shares = choice_shares(np.array([1000.0, 999.0, -1000.0]))
    assert np.isclose(shares.sum(), 1.0)
    assert np.isclose(shares[0] / shares[1], np.e)
