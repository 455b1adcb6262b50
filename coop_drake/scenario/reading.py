"""Reads one YAML file into one frozen dataclass, or says where the file departs from it."""

from pathlib import Path
from typing import TypeVar

from coop_drake.errors import ScenarioError
from coop_drake.scenario.document import DocumentError
from coop_drake.scenario.scalars import SchemaError
from coop_drake.scenario.schema import departures, read

T = TypeVar("T")


def read_file(cls: type[T], path: Path) -> T:
    """Read a file.

    Args:
        cls: A frozen dataclass.
        path: The file.

    Raises:
        ScenarioError: The file cannot be read, is no YAML, or departs from the schema; with key and value.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise ScenarioError(str(path), "the file", str(error), "a readable file") from error
    try:
        for departure in departures(cls, text):
            raise departure
        value: T = read(cls, text)
    except SchemaError as error:
        raise ScenarioError(str(path), error.key, error.value, error.allowed) from error
    except DocumentError as error:
        raise ScenarioError(str(path), error.place, error.problem, error.allowed) from error
    return value
