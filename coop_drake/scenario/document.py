"""YAML text to plain data, with the places where the text itself is wrong."""

from typing import Any

import yaml

_DEEPEST = 50
"""Lists and mappings in each other; a scenario needs ten."""
_LARGEST = 1_000_000
"""Values of a file, repetitions by alias counted as often as they are repeated."""

_Parser = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


class DocumentError(ValueError):
    """The text is no YAML, or it says one thing twice.

    Args:
        place: Line and column, both counted from 1.
        problem: What stands there.
        allowed: What may stand there.
    """

    def __init__(self, place: str, problem: str, allowed: str) -> None:
        self.place, self.problem, self.allowed = place, problem, allowed
        super().__init__(f"{place}: {problem}; expected {allowed}")


class _Loader(_Parser):  # type: ignore[valid-type,misc]
    """Plain data as Drake's loader has it, parsed by compiled code where there is some."""

    def tagged(self, tag: str, node: yaml.Node) -> dict[Any, Any]:
        """A mapping with its tag under ``_tag``; nothing else may have one."""
        return {**self.construct_mapping(node, deep=True), "_tag": tag}


_Loader.add_multi_constructor("", _Loader.tagged)


def parse(text: str) -> object:
    """Parse YAML text into plain data as Drake does, tags kept under ``_tag``.

    Like there, keys of the whole file that begin with an underscore are left out: they hold templates.

    Raises:
        DocumentError: Where the text does not parse, a mapping has one key twice, or the text is made to be
            larger than it looks.
    """
    try:
        _refuse_deep(text)
        loader = _Loader(text)
        root = loader.get_single_node()
        if root is None:
            return None
        _Expansion().size(root)
        _refuse_numbered(root)
        data = loader.construct_document(root)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark
        raise DocumentError(_place(mark), error.problem or "unreadable text", "valid YAML") from error
    except DocumentError:
        raise
    except yaml.reader.ReaderError as error:
        character = f"character {error.character!r} at {error.position}"
        raise DocumentError("the file", character, "text without control characters") from error
    except (
        yaml.YAMLError,
        AttributeError,
        TypeError,
        ValueError,
    ) as error:  # no number, no day of a calendar
        raise DocumentError("the file", str(error), "valid YAML") from error
    if isinstance(data, dict):
        return {key: value for key, value in data.items() if not str(key).startswith("_")}
    return data


def _place(mark: yaml.Mark | None) -> str:
    return f"line {mark.line + 1}, column {mark.column + 1}" if mark else "the file"


def _refuse_deep(text: str) -> None:
    """Stop before nesting that would take all time, or the stack, to read."""
    depth = 0
    for event in yaml.parse(text, Loader=_Parser):
        depth += isinstance(event, yaml.CollectionStartEvent) - isinstance(event, yaml.CollectionEndEvent)
        if depth > _DEEPEST:
            place = _place(event.start_mark)
            raise DocumentError(
                place, "endless nesting", f"at most {_DEEPEST} lists and mappings in each other"
            )


class _Expansion:
    """How much a document holds once every alias stands for its value; walks each node once."""

    def __init__(self) -> None:
        self._sizes: dict[int, int | None] = {}

    def size(self, node: yaml.Node, depth: int = 0) -> int:
        """Values in a node, and a refusal of what is too much, endless, or said twice.

        Raises:
            DocumentError: With the place.
        """
        if isinstance(node, yaml.ScalarNode):
            return 1
        if id(node) not in self._sizes:
            self._sizes[id(node)] = None
            self._sizes[id(node)] = self._measure(node, depth)
        size = self._sizes[id(node)]
        if size is None:
            raise DocumentError(_place(node.start_mark), "endless nesting", "nothing that holds itself")
        return size

    def _measure(self, node: yaml.Node, depth: int) -> int:
        if depth > _DEEPEST:
            allowed = f"at most {_DEEPEST} lists and mappings in each other"
            raise DocumentError(_place(node.start_mark), "endless nesting", allowed)
        if isinstance(node, yaml.MappingNode):
            _refuse_duplicates(node)
            inner = [part for pair in node.value for part in pair]
        else:
            inner = node.value
        total = 1 + sum(self.size(part, depth + 1) for part in inner)
        if total > _LARGEST:
            place = _place(node.start_mark)
            raise DocumentError(place, f"{total} values by repetition", f"at most {_LARGEST} values")
        return total


def _refuse_duplicates(node: yaml.MappingNode) -> None:
    """PyYAML keeps the last of two equal keys without a word."""
    seen: set[str] = set()
    for key, _ in node.value:
        if key.value != "<<" and str(key.value) in seen:
            raise DocumentError(_place(key.start_mark), str(key.value), "every key once")
        seen.add(str(key.value))


def _refuse_numbered(root: yaml.Node) -> None:
    """Drake takes nothing but texts for the keys of a whole file."""
    for key, _ in root.value if isinstance(root, yaml.MappingNode) else ():
        if key.tag not in ("tag:yaml.org,2002:str", "tag:yaml.org,2002:merge"):
            shown = key.value if isinstance(key, yaml.ScalarNode) else "a list or a mapping"
            raise DocumentError(_place(key.start_mark), shown, "a text as the key")
