"""Reads and writes YAML; refuses text that Drake would misread or that would fill the memory."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, TypeVar

import yaml

from coop_drake.errors import Finding, ScenarioError
from coop_drake.files import check_readable
from coop_drake.typed_data import DataError, convert_class

_DEEPEST = 50
"""Levels of lists and mappings inside each other; a scenario needs ten."""

_LARGEST = 1_000_000
"""Values of a file; what an alias repeats counts as often as it is repeated."""

_LARGEST_FILE = 4.0
"""Largest file [MB]; it takes some seconds. A floor with more corners can stand in a drawing beside it."""

_FLOAT = re.compile(r"[-+]?\d[\d_]*(\.[\d_]*)?[eE][-+]?\d+\Z")
"""Numbers that YAML 1.2 knows and YAML 1.1 takes for texts, such as ``1e-3``."""

T = TypeVar("T")
_Parser = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


class _Loader(_Parser):  # type: ignore[valid-type,misc]
    """Loads what Drake's own loader loads, with compiled code where PyYAML has it."""

    def tagged(self, tag: str, node: yaml.Node) -> dict[Any, Any]:
        """Return a mapping with its tag under ``_tag``; no other value may have a tag."""
        return {**self.construct_mapping(node, deep=True), "_tag": tag}


_Loader.add_multi_constructor("", _Loader.tagged)
_Loader.add_implicit_resolver("tag:yaml.org,2002:float", _FLOAT, list("-+0123456789"))


class _Dumper(yaml.SafeDumper):
    """Writes plain data as Drake's own writer does: mappings in their order, one line for each entry."""

    def mapping(self, data: dict[str, Any]) -> yaml.Node:
        """Return a mapping as a node; the entry ``_tag`` becomes its tag."""
        pairs = [pair for pair in data.items() if pair[0] != "_tag"]
        node = self.represent_mapping(data.get("_tag", "tag:yaml.org,2002:map"), pairs)
        node.flow_style = not pairs
        return node


_Dumper.add_representer(dict, _Dumper.mapping)
_Dumper.add_implicit_resolver("tag:yaml.org,2002:float", _FLOAT, list("-+0123456789"))  # Quotes such texts.


def write(data: object) -> str:
    """Write plain data as YAML text that :func:`parse` reads back."""
    return str(yaml.dump(data, Dumper=_Dumper, default_flow_style=None))


def parse(text: str) -> object:
    """Parse YAML text into plain data as Drake does, tags kept under ``_tag``.

    As in Drake, keys of the whole file that begin with an underscore are left out: they hold templates.

    Raises:
        DataError: The text does not parse, a mapping has one key twice, or aliases repeat too much. The key
            is the line and the column, counted from 1, where they are known.
    """
    try:
        _check_events(yaml.parse(text, Loader=_Parser))
        data = yaml.load(text, Loader=_Loader)
    except DataError:
        raise
    except yaml.MarkedYAMLError as error:
        place = _place(error.problem_mark) if error.problem_mark else "the file"
        raise DataError(place, Finding(error.problem or "unreadable text"), "valid YAML") from error
    except (yaml.YAMLError, AttributeError, TypeError, ValueError) as error:
        # PyYAML also lets through what int(), float() and date() raise.
        raise DataError("the file", Finding(" ".join(str(error).split())), "valid YAML") from error
    if isinstance(data, dict):
        return {key: value for key, value in data.items() if not str(key).startswith("_")}
    return data


def read_file(cls: type[T], path: Path) -> T:
    """Read a file into a frozen dataclass of the types that :mod:`coop_drake.typed_data` knows.

    Raises:
        ScenarioError: The file cannot be read, is no YAML, or departs from the dataclass; with key and value.
    """
    try:
        return convert_class(parse(check_readable(path, _LARGEST_FILE).read_text(encoding="utf-8")), cls)
    except DataError as error:
        raise ScenarioError.of(str(path), error.faults) from error
    except (OSError, UnicodeDecodeError) as error:
        raise ScenarioError(str(path), "the file", Finding(error), "a readable file") from error


def _place(mark: yaml.Mark) -> str:
    return f"line {mark.line + 1}, column {mark.column + 1}"


class _Collection:
    """A list or mapping of the text, from its start event to its end event.

    Attributes:
        size: Values in it so far, itself included, every alias counted as what it repeats.
        height: Levels of collections in it so far, itself included.
        closed: Whether its end event has come.
    """

    def __init__(self, event: yaml.CollectionStartEvent) -> None:
        self.place, self.size, self.height, self.closed = _place(event.start_mark), 1, 1, False
        self._keys: set[str] | None = set() if isinstance(event, yaml.MappingStartEvent) else None
        self._entries = 0

    def add(self, event: yaml.Event, size: int, height: int) -> None:
        """Count an entry, and refuse a key that the mapping has already: PyYAML would keep the last."""
        if self._keys is not None and self._entries % 2 == 0 and isinstance(event, yaml.ScalarEvent):
            if event.value in self._keys and event.value != "<<":
                raise DataError(_place(event.start_mark), event.value, "each key at most once")
            self._keys.add(event.value)
        self._entries += 1
        self.size += size
        self.height = max(self.height, height + 1)
        if self.size > _LARGEST:
            raise DataError(
                self.place, Finding(f"{self.size} values by repetition"), f"at most {_LARGEST} values"
            )


def _check_events(events: Iterator[yaml.Event]) -> None:
    """Refuse repeated keys, and nesting or repetition that would take all memory, before anything is built.

    Raises:
        DataError: With the place.
    """
    around: list[_Collection] = []
    anchors: dict[str | None, _Collection] = {}
    for event in events:
        size, height = 1, 0
        if isinstance(event, yaml.CollectionStartEvent):
            around.append(_Collection(event))
            anchors[event.anchor] = around[-1]
        elif isinstance(event, yaml.CollectionEndEvent):
            done = around.pop()
            done.closed, size, height = True, done.size, done.height
        elif isinstance(event, yaml.AliasEvent) and event.anchor in anchors:
            repeated = anchors[event.anchor]
            if not repeated.closed:
                raise DataError(
                    repeated.place, Finding("a circular reference"), "data that does not contain itself"
                )
            size, height = repeated.size, repeated.height
        if len(around) + height > _DEEPEST:
            allowed = f"at most {_DEEPEST} lists and mappings inside one another"
            raise DataError(_place(event.start_mark), Finding("too deep nesting"), allowed)
        if around and not isinstance(event, yaml.CollectionStartEvent):
            around[-1].add(event, size, height)
