"""Changes of single keys in a YAML text, which leave everything else, comments too, as it is."""

import copy
import json
import re
from collections.abc import Iterable, Mapping
from typing import Any

import yaml

from .plain_data import Path, dotted
from .plain_yaml import read_yaml, scalar

# A value that means: remove the key.
REMOVED = object()

# A word that needs no quotes anywhere, such as the name of a part or file.
BARE = re.compile(r"[A-Za-z_][\w./+-]*")


def flow(value: Any) -> str:
    """Return a value as one line of YAML.

    >>> flow({"positions_m": [[0, -40.5]], "model": "ring", "name": "a: b"})
    '{positions_m: [[0, -40.5]], model: ring, name: "a: b"}'
    """
    if isinstance(value, Mapping):
        pairs = (f"{flow(str(key))}: {flow(own)}" for key, own in value.items())
        return f"{{{', '.join(pairs)}}}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(flow, value))}]"
    if isinstance(value, str) and BARE.fullmatch(value) and scalar(value) == value:
        return value
    return json.dumps(value, ensure_ascii=False)


def edited(text: str, changes: Iterable[tuple[Path, Any]]) -> str:
    """Return a YAML text with changes of values made one after the other; `REMOVED` removes a key.

    >>> edited("a: {b: 1}  # why\\nc: 2\\n", [(("a", "d"), [1]), (("c",), REMOVED)])
    'a: {b: 1, d: [1]}  # why\\n'

    Raises:
        ValueError: when the text is no mapping, or a key of it cannot be changed in its place.
    """
    for path, value in changes:
        before = read_yaml(text, "").data
        if not isinstance(before, dict):
            raise ValueError("the text holds no keys that could be changed; mend it first")
        wanted = _put(copy.deepcopy(before), path, value)
        text = _changed(text, path, value)
        if read_yaml(text, "").data != wanted:
            raise ValueError(f"{dotted(path)}: cannot be changed where it stands; edit the text")
    return text


def _put(data: dict[str, Any], path: Path, value: Any) -> dict[str, Any]:
    """Return data with another value of a key, or without the key."""
    inner: Any = data
    for part in path[:-1]:
        if not isinstance(inner.get(part), dict):
            if value is REMOVED:
                return data
            inner[part] = {}
        inner = inner[part]
    if value is REMOVED:
        inner.pop(path[-1], None)
    else:
        inner[path[-1]] = value
    return data


def _changed(text: str, path: Path, value: Any) -> str:
    node: Any = yaml.compose(text, Loader=yaml.SafeLoader)  # its marks count characters
    for depth, name in enumerate(path):
        pairs = node.value
        found = next((n for n, (key, _) in enumerate(pairs) if key.value == name), None)
        if found is None:
            return text if value is REMOVED else _added(text, node, path[depth:], value)
        key, below = pairs[found]
        is_last = depth == len(path) - 1
        if value is REMOVED and is_last:
            return _without(text, node, found)
        if is_last or not isinstance(below, yaml.MappingNode):
            if value is REMOVED:
                return text
            for part in reversed(path[depth + 1 :]):
                value = {part: value}
            return f"{text[: key.end_mark.index]}: {flow(value)}{text[_end(below) :]}"
        node = below
    return text


def _end(node: Any) -> int:
    """Return the offset of a value's end, without blank lines and comments after a block."""
    if isinstance(node, yaml.ScalarNode) or node.flow_style or not node.value:
        return int(node.end_mark.index)
    last = node.value[-1]
    return _end(last[1] if isinstance(last, tuple) else last)


def _added(text: str, node: Any, path: Path, value: Any) -> str:
    """Return the text with a further entry at the end of a mapping."""
    name, *below = path
    for part in reversed(below):
        value = {part: value}
    entry = f"{flow(str(name))}: {flow(value)}"
    if node.flow_style:
        end = node.end_mark.index - 1
        return f"{text[:end].rstrip()}{', ' if node.value else ''}{entry}{text[end:]}"
    line_end = text.find("\n", _end(node) - (text[_end(node) - 1] == "\n"))
    line_end = len(text) if line_end < 0 else line_end
    indent = " " * int(node.value[0][0].start_mark.column)
    return f"{text[:line_end]}\n{indent}{entry}{text[line_end:] or chr(10)}"


def _without(text: str, node: Any, number: int) -> str:
    """Return the text without an entry of a mapping and the comment behind it."""
    key, value = node.value[number]
    begin, end = int(key.start_mark.index), _end(value)
    if node.flow_style:
        if number + 1 < len(node.value):
            return text[:begin] + text[int(node.value[number + 1][0].start_mark.index) :]
        begin = _end(node.value[number - 1][1]) if number else begin
        return text[:begin] + text[end:]
    if len(node.value) == 1:
        return f"{text[:begin]}{{}}{text[end:]}"
    line_end = text.find("\n", end - (text[end - 1] == "\n"))
    begin = text.rfind("\n", 0, begin) + 1
    return text[:begin] + (text[line_end + 1 :] if line_end >= 0 else "")
