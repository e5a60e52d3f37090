"""YAML text as a tree of texts, for calibration files of several dialects."""

from __future__ import annotations

import re
from collections.abc import Hashable
from typing import Final

import yaml  # type: ignore[import-untyped, unused-ignore]

__all__ = ["tree_of"]

_OPENCV_DIRECTIVE: Final = re.compile(r"\A%YAML[: ]*[\d.]*[^\n]*")


def tree_of(text: str) -> object:
    """The content; every scalar is its text. Raises `ValueError` for what is no YAML."""
    try:
        return yaml.load(_plain_yaml(text), Loader=_Loader)
    except yaml.YAMLError as error:
        raise ValueError(str(error)) from error


def _plain_yaml(text: str) -> str:
    """OpenCV's `%YAML:1.0` line is no YAML directive, and tabs are no YAML white space: both are made harmless."""
    return _OPENCV_DIRECTIVE.sub("#", text.replace("\t", "    "))


class _Loader(yaml.BaseLoader):  # type: ignore[misc, unused-ignore]
    """Reads every scalar as its text and ignores tags (`!!opencv-matrix`), so that 1e-5 is not a matter of dialect."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Hashable, object]:
        if not isinstance(node, yaml.MappingNode):
            raise yaml.constructor.ConstructorError(None, None, "expected a mapping", node.start_mark)
        pairs: dict[Hashable, object] = {}
        for key_node, value_node in node.value:
            if not isinstance(key_node, yaml.ScalarNode):
                raise yaml.constructor.ConstructorError(None, None, "found a key that is no word", key_node.start_mark)
            key, value = key_node.value, self.construct_object(value_node, deep=True)
            if key in pairs and not _same(pairs[key], value):
                raise yaml.constructor.ConstructorError(
                    None, None, f"found the key {key!r} twice with different values", key_node.start_mark
                )
            pairs[key] = value
        return pairs


def _same(one: object, other: object) -> bool:
    try:
        return one == other
    except RecursionError:
        return False
