"""YAML text as a tree of texts, for calibration files of several dialects."""

from __future__ import annotations

import re
from collections.abc import Hashable
from typing import Any, Final

import yaml  # type: ignore[import-untyped, unused-ignore]

__all__ = ["LARGEST_YAML_BYTES", "MOST_YAML_VALUES", "tree_of"]

LARGEST_YAML_BYTES: Final = 150_000
"""PyYAML reads some 100 kB a second of the worst text."""
MOST_YAML_VALUES: Final = 10_000
"""PyYAML reads some 12,000 keys and values a second; what an alias stands for counts every time."""
DEEPEST_YAML: Final = 50
"""Levels of nesting; calibrations have up to 6."""
_OPENCV_DIRECTIVE: Final = re.compile(r"\A%YAML[: ]*[\d.]*[^\n]*")


def tree_of(text: str) -> object:
    """The content; every scalar is its text. Raises `ValueError` for what is no YAML or more of it than the limits."""
    if len(text) > LARGEST_YAML_BYTES:
        raise ValueError(f"{len(text)} characters of YAML, more than {LARGEST_YAML_BYTES}")
    try:
        return yaml.load(_plain_yaml(text), Loader=_Loader)
    except yaml.YAMLError as error:
        raise ValueError(str(error)) from error


def _plain_yaml(text: str) -> str:
    """OpenCV's `%YAML:1.0` line is no YAML directive, and tabs are no YAML white space: both are made harmless."""
    return _OPENCV_DIRECTIVE.sub("#", text.replace("\t", "    "))


class _Loader(yaml.BaseLoader):  # type: ignore[misc, unused-ignore]
    """Reads every scalar as its text and ignores tags (`!!opencv-matrix`), so that 1e-5 is not a matter of dialect."""

    def __init__(self, text: str) -> None:
        super().__init__(text)
        self._depth = 0
        self._values = 0
        self._sizes: dict[int, int] = {}
        """The values that each complete node with an anchor stands for, itself included."""

    def compose_node(self, parent: Any, index: Any) -> Any:
        """Counts what it composes: an alias stands for as many values as it repeats."""
        before, is_alias = self._values, self.check_event(yaml.AliasEvent)
        event: Any = self.peek_event()  # type: ignore[no-untyped-call, unused-ignore]
        mark, anchor = event.start_mark, event.anchor
        self._depth += 1
        if self._depth > DEEPEST_YAML:
            raise yaml.composer.ComposerError(None, None, f"nested deeper than {DEEPEST_YAML} levels", mark)
        node = super().compose_node(parent, index)
        if is_alias and id(node) not in self._sizes:
            raise yaml.composer.ComposerError(None, None, f"found the alias {anchor!r} in what it stands for", mark)
        self._values += self._sizes[id(node)] if is_alias else 1
        if self._values > MOST_YAML_VALUES:
            raise yaml.composer.ComposerError(None, None, f"more than {MOST_YAML_VALUES} keys and values", mark)
        if anchor is not None and not is_alias:
            self._sizes[id(node)] = self._values - before
        self._depth -= 1
        return node

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Hashable, object]:
        if not isinstance(node, yaml.MappingNode):
            raise yaml.constructor.ConstructorError(None, None, "expected a mapping", node.start_mark)
        pairs: dict[Hashable, object] = {}
        for key_node, value_node in node.value:
            if not isinstance(key_node, yaml.ScalarNode):
                raise yaml.constructor.ConstructorError(None, None, "found a key that is no word", key_node.start_mark)
            key, value = key_node.value, self.construct_object(value_node, deep=True)
            if key in pairs and pairs[key] != value:
                raise yaml.constructor.ConstructorError(
                    None, None, f"found the key {key!r} twice with different values", key_node.start_mark
                )
            pairs[key] = value
        return pairs
