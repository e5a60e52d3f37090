"""YAML is read as PyYAML reads it, and what is written PyYAML reads."""

from __future__ import annotations

import random

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from calibration_texts import SAMPLES
from tiltvp.formats.yaml_text import DEEPEST_YAML, MOST_YAML_VALUES, tree_of, yaml_of

TEXTS = sorted(key for key, sample in SAMPLES.items() if sample.text.startswith(("%YAML", "cam0:", "image")))


def by_pyyaml(text: str) -> object:
    """The tree of texts, tags not looked at."""
    return yaml.load(text.replace("%YAML:1.0", "#"), Loader=yaml.BaseLoader)


@pytest.mark.parametrize("key", TEXTS)
def test_every_sample(key: str) -> None:
    assert tree_of(SAMPLES[key].text) == by_pyyaml(SAMPLES[key].text)


@pytest.mark.parametrize("key", TEXTS)
def test_numbers_of_a_list_may_go_on_anywhere(key: str) -> None:
    text, rng = SAMPLES[key].text, random.Random(1)
    commas = [k for k, c in enumerate(text) if text[k : k + 2] == ", " and "[" in text[text.rfind("\n", 0, k) : k]]
    for k in rng.sample(commas, min(8, len(commas))):
        for indent in ("", " ", "\t", " " * 20):
            broken = f"{text[: k + 1]}\n{indent}{text[k + 2 :]}"
            assert tree_of(broken) == tree_of(text) == by_pyyaml(text)


texts = st.text(st.characters(codec="utf-8"), min_size=1) | st.sampled_from(
    ["no", "null", "1e5", "~", "a: b", "- a", "#"]
)
values = texts | st.integers() | st.floats(allow_nan=False, allow_infinity=False)
lists = st.lists(values) | st.lists(st.lists(values, min_size=1), min_size=1)
# A key of YAML has at most 1,024 characters, escapes of ten included.
keys = texts.filter(lambda text: len(text) <= 100)
tables = st.recursive(values | lists, lambda inner: st.dictionaries(keys, inner, min_size=1), max_leaves=12)


@pytest.mark.slow
@given(st.dictionaries(keys, tables, min_size=1))
def test_what_is_written_is_read(table: dict[str, object]) -> None:
    text = yaml_of(table)
    assert yaml.safe_load(text) == table
    assert str(tree_of(text)) == str(as_texts(table))


def as_texts(value: object) -> object:
    """Numbers as they are written."""
    if isinstance(value, dict):
        return {key: as_texts(one) for key, one in value.items()}
    if isinstance(value, list):
        return [as_texts(one) for one in value]
    return value if isinstance(value, str) else yaml_of({"a": value}).removeprefix("a: ").rstrip()


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("a: 1\na: 2\n", "found the key 'a' twice with different values, line 2, column 1"),
        ("a: &x [*x]\n", "found an alias in what it stands for, line 1, column 8"),
        ("a: *x\n", "unknown anchor, line 1, column 4"),
        ("a: 1\n---\nb: 2\n", "found a second document, line 2, column 1"),
        ("[a]: 1\n", "found a key that is no word, line 1, column 1"),
        ("a: \x07\n", "found the character U\\+0007, line 1"),
        ("[" * DEEPEST_YAML + "1" + "]" * DEEPEST_YAML, f"nested deeper than {DEEPEST_YAML} levels"),
        ("[" + "1," * MOST_YAML_VALUES + "]", f"more than {MOST_YAML_VALUES} keys and values"),
        ("a: &x [1, 1, 1, 1]\nb: [" + "*x," * 3_000 + "]", f"more than {MOST_YAML_VALUES} keys and values"),
    ],
)
def test_refusals_say_what_and_where(text: str, problem: str) -> None:
    with pytest.raises(ValueError, match=problem):
        tree_of(text)


def test_an_alias_is_one_object_and_equal_keys_are_one() -> None:
    assert tree_of("# nothing\n") is None
    assert tree_of("a: 1\na: 1\n") == {"a": "1"}
    tree = tree_of("a: &x [1, 2]\nb: *x\n")
    assert isinstance(tree, dict)
    assert tree["a"] is tree["b"]
