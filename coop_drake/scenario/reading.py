"""Reads one YAML file into one frozen dataclass."""

from pathlib import Path
from typing import TypeVar

from coop_drake.errors import ScenarioError
from coop_drake.files import check_readable
from coop_drake.scenario.document import parse
from coop_drake.typed_data import DataError, convert_class

T = TypeVar("T")
_LARGEST = 4.0
"""Largest file [MB]; it takes some seconds. A floor with more corners can stand in a drawing beside it."""


def read_file(cls: type[T], path: Path) -> T:
    """Read a file into a frozen dataclass of the types that :mod:`coop_drake.typed_data` knows.

    Raises:
        ScenarioError: The file cannot be read, is no YAML, or departs from the dataclass; with key and value.
    """
    try:
        return convert_class(parse(check_readable(path, _LARGEST).read_text(encoding="utf-8")), cls)
    except DataError as error:
        raise ScenarioError(str(path), error.key or "the file", error.value, error.allowed) from error
    except (OSError, UnicodeDecodeError) as error:
        raise ScenarioError(str(path), "the file", str(error), "a readable file") from error
