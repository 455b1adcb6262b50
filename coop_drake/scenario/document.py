"""YAML text to plain data, with the places where the text itself is wrong."""

import yaml
from pydrake.common.yaml import yaml_load_data


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


def parse(text: str) -> object:
    """Parse YAML text into plain data as Drake does, tags kept under ``_tag``.

    Raises:
        DocumentError: Where the text does not parse, or a mapping has one key twice.
    """
    try:
        root = yaml.compose(text, Loader=yaml.SafeLoader)
        if root is not None:
            _refuse_duplicates(root)
            _refuse_numbered(root)
        return yaml_load_data(text)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark
        raise DocumentError(_place(mark), error.problem or "unreadable text", "valid YAML") from error
    except DocumentError:
        raise
    except (yaml.YAMLError, ValueError) as error:  # ValueError: no number, or a day that no calendar has
        raise DocumentError("the file", str(error), "valid YAML") from error
    except RecursionError as error:
        raise DocumentError("the file", "endless nesting", "valid YAML that does not hold itself") from error


def _place(mark: yaml.Mark | None) -> str:
    return f"line {mark.line + 1}, column {mark.column + 1}" if mark else "the file"


def _refuse_duplicates(node: yaml.Node) -> None:
    """PyYAML keeps the last of two equal keys without a word."""
    if isinstance(node, yaml.MappingNode):
        seen: set[str] = set()
        for key, value in node.value:
            if key.value != "<<" and str(key.value) in seen:
                raise DocumentError(_place(key.start_mark), str(key.value), "every key once")
            seen.add(str(key.value))
            _refuse_duplicates(value)
    elif isinstance(node, yaml.SequenceNode):
        for item in node.value:
            _refuse_duplicates(item)


def _refuse_numbered(root: yaml.Node) -> None:
    """Drake takes nothing but texts for the keys of a whole file."""
    for key, _ in root.value if isinstance(root, yaml.MappingNode) else ():
        if key.tag not in ("tag:yaml.org,2002:str", "tag:yaml.org,2002:merge"):
            raise DocumentError(_place(key.start_mark), str(key.value), "a text as the key")
