"""The text of a model file, before Drake reads it: XML as it should be, and words that Drake passes over.

Drake's readers take what follows the root for nothing, leave entities as they stand and go on; that of URDF
passes over every element and attribute that it does not know, also where it is a known one with a slip in it.
"""

from __future__ import annotations

from difflib import get_close_matches
from pathlib import Path
from xml.parsers import expat

from coop_drake.plant.model_numbers import fault_of_attribute, fault_of_text

__all__ = ["fault_of"]

_ROOTS = {".sdf": "sdf", ".urdf": "robot"}
_DEEPEST = 100
_URDF: dict[str, tuple[str, str]] = {
    "robot": ("link joint material transmission gazebo", "name version"),
    "link": ("inertial visual collision", "name type"),
    "inertial": ("origin mass inertia", ""),
    "visual": ("origin geometry material", "name"),
    "collision": ("origin geometry", "name"),
    "geometry": ("box cylinder sphere mesh capsule", ""),
    "joint": ("origin parent child axis calibration dynamics limit mimic safety_controller", "name type"),
    "origin": ("", "xyz rpy"),
    "mass": ("", "value"),
    "inertia": ("", "ixx ixy ixz iyy iyz izz"),
    "box": ("", "size"),
    "cylinder": ("", "radius length"),
    "capsule": ("", "radius length"),
    "sphere": ("", "radius"),
    "mesh": ("", "filename scale"),
    "parent": ("", "link"),
    "child": ("", "link"),
    "axis": ("", "xyz"),
    "limit": ("", "lower upper effort velocity"),
    "mimic": ("", "joint multiplier offset"),
    "dynamics": ("", "damping friction"),
}
"""Elements of URDF with what may stand in them; anything else is an extension unless it looks like a slip."""
_ALIKE = 0.8


class _FaultError(Exception):
    """What is wrong; the parser knows where."""


def fault_of(path: Path) -> str:
    """What is wrong with the text of a model file, with its line, or nothing.

    Args:
        path: A file that exists; its ending says what it should hold.
    """
    reader = _Reader(path.suffix)
    try:
        reader.parser.Parse(path.read_bytes(), True)
    except expat.ExpatError as error:
        return f"{path}: line {error.lineno}: {expat.ErrorString(error.code)}"
    except (_FaultError, LookupError) as error:  # LookupError: an encoding that nobody knows
        return f"{path}: line {reader.parser.CurrentLineNumber}: {error}"
    except OSError as error:
        return str(error)
    return ""


class _Reader:
    """Walks a document without keeping it."""

    def __init__(self, suffix: str) -> None:
        self.suffix = suffix
        self.trail: list[str] = []
        self.text = ""
        self.parser = expat.ParserCreate()
        self.parser.StartElementHandler = self._start
        self.parser.EndElementHandler = self._end
        self.parser.CharacterDataHandler = self._add_text
        self.parser.EntityDeclHandler = self._entity

    def _start(self, name: str, attributes: dict[str, str]) -> None:
        root = _ROOTS[self.suffix]
        if not self.trail and name != root:
            raise _FaultError(f"<{name}> is the root; a {self.suffix} file has <{root}>")
        if len(self.trail) >= _DEEPEST:
            raise _FaultError(f"more than {_DEEPEST} elements in each other")
        if self.suffix == ".urdf":
            self._check_words(name, attributes)
        self.trail.append(name)
        self.text = ""

    def _end(self, name: str) -> None:
        if self.suffix == ".sdf":
            _refuse(fault_of_text(name, self.text))
        self.trail.pop()
        self.text = ""

    def _add_text(self, text: str) -> None:
        self.text += text

    def _check_words(self, name: str, attributes: dict[str, str]) -> None:
        above = self.trail[-1] if self.trail else ""
        if above in _URDF:
            _refuse_slip(f"<{name}>", name, _URDF[above][0].split())
        if name in _URDF and (above in _URDF or not above):
            for word, value in attributes.items():
                _refuse_slip(f"{word} of <{name}>", word, _URDF[name][1].split())
                _refuse(fault_of_attribute(name, word, value))

    def _entity(self, name: str, *_: object) -> None:
        raise _FaultError(f"the entity {name} is declared; Drake's readers know none")


def _refuse(fault: str) -> None:
    if fault:
        raise _FaultError(fault)


def _refuse_slip(shown: str, word: str, known: list[str]) -> None:
    if word in known or ":" in word:
        return
    meant = get_close_matches(word, known, n=1, cutoff=_ALIKE)
    if meant:
        raise _FaultError(f"{shown} is unknown; {meant[0]} is meant?")
