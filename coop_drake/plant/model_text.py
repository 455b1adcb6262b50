"""Checks the text of a model file before Drake reads it, for faults that Drake's readers pass over.

They take ``1m`` for 1 and the first three numbers of four, ignore what follows the root and leave entities as
they stand; the reader of URDF also ignores every element and attribute that it does not know, misspelt ones
included.
"""

from __future__ import annotations

from difflib import get_close_matches
from math import isfinite, isnan
from pathlib import Path
from xml.parsers import expat

from coop_drake.files import check_readable

_ROOTS = {".sdf": "sdf", ".urdf": "robot"}
_LARGEST = 20.0
"""Largest model file [MB]; whole robots have less than one."""
_DEEPEST = 100
"""Elements inside each other that are allowed; models have about ten, and Drake's readers recurse."""
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
"""Elements of URDF with the elements and attributes that they may have; other names are extensions, unless
they resemble one of these."""
_ALIKE = 0.8
"""Similarity of two names, by difflib's ratio, from which one counts as a misspelling of the other [-]."""
_LIMITS = ("lower", "upper", "effort", "velocity")
"""Numbers that may be infinite."""
_MAGNITUDES = ("velocity", "drake:acceleration")
"""Limits that Drake's reader of URDF ends the process over where they are negative; in SDF these are none."""
_COUNTS: dict[str, tuple[int, ...]] = {
    **dict.fromkeys(("mass", "ixx", "ixy", "ixz", "iyy", "iyz", "izz", "radius", "length", "damping"), (1,)),
    **dict.fromkeys(_LIMITS, (1,)),
    "xyz": (3,),
}
"""How many numbers stand in elements of SDF and attributes of URDF of one name."""
_SDF_COUNTS = _COUNTS | {"pose": (6, 7), "size": (2, 3), "scale": (3,)}
_SDF_COUNTS |= dict.fromkeys(("ambient", "diffuse", "specular", "emissive"), (3, 4))
_URDF_COUNTS = _COUNTS | {"rpy": (3,), "size": (3,), "scale": (1, 3), "rgba": (4,)}
_URDF_COUNTS |= dict.fromkeys(("value", "friction", "multiplier", "offset"), (1,))


class _FaultError(Exception):
    """A fault in the text; its place is where the parser stands."""


def fault_of(path: Path) -> str:
    """Describe the first fault in the text of a model file, with its line; an empty text if there is none.

    The file exists; its suffix says its format.
    """
    reader = _ModelText(path.suffix)
    try:
        reader.parser.Parse(check_readable(path, _LARGEST).read_bytes(), True)
    except expat.ExpatError as error:
        return f"{path}: line {error.lineno}: {expat.ErrorString(error.code)}"
    except (_FaultError, LookupError) as error:  # LookupError: the file names an unknown encoding
        return f"{path}: line {reader.parser.CurrentLineNumber}: {error}"
    except OSError as error:
        return str(error)
    return ""


class _ModelText:
    """Handlers of an XML parser that raise at the first fault."""

    def __init__(self, suffix: str) -> None:
        self.suffix = suffix
        self.ancestors: list[str] = []
        self.text = ""
        self.parser = expat.ParserCreate()
        self.parser.StartElementHandler = self._start
        self.parser.EndElementHandler = self._end
        self.parser.CharacterDataHandler = self._add_text
        self.parser.EntityDeclHandler = self._entity

    def _start(self, name: str, attributes: dict[str, str]) -> None:
        root = _ROOTS[self.suffix]
        if not self.ancestors and name != root:
            raise _FaultError(f"<{name}> is the root; a {self.suffix} file has <{root}>")
        if len(self.ancestors) >= _DEEPEST:
            raise _FaultError(f"more than {_DEEPEST} elements inside each other")
        if self.suffix == ".urdf":
            self._check_urdf(name, attributes)
        self.ancestors.append(name)
        self.text = ""

    def _end(self, name: str) -> None:
        if self.suffix == ".sdf" and self.text.split():  # an empty element has its default
            _check_numbers(f"<{name}>", name, self.text, _SDF_COUNTS)
        self.ancestors.pop()
        self.text = ""

    def _add_text(self, text: str) -> None:
        self.text += text

    def _check_urdf(self, name: str, attributes: dict[str, str]) -> None:
        parent = self.ancestors[-1] if self.ancestors else ""
        if parent in _URDF:
            _check_name(f"<{name}>", name, _URDF[parent][0].split())
        if name in _URDF and (parent in _URDF or not parent):
            for attribute, value in attributes.items():
                shown = f"{attribute} of <{name}>"
                _check_name(shown, attribute, _URDF[name][1].split())
                _check_numbers(shown, attribute, value, _URDF_COUNTS)
                if attribute in _MAGNITUDES and _number(value) < 0.0:
                    raise _FaultError(f"{value!r} in {shown} is negative; expected a magnitude")

    def _entity(self, name: str, *_: object) -> None:
        raise _FaultError(f"the entity {name} is declared; Drake's readers know none")


def _check_name(shown: str, name: str, known: list[str]) -> None:
    """Refuse a name that is unknown but resembles a known one; names with a prefix are extensions."""
    if name not in known and ":" not in name:
        for meant in get_close_matches(name, known, n=1, cutoff=_ALIKE):
            raise _FaultError(f"{shown} is unknown; {meant} is meant?")


def _check_numbers(shown: str, name: str, text: str, counts: dict[str, tuple[int, ...]]) -> None:
    """Refuse text that is not as many finite numbers as stand under a name."""
    if name not in counts:
        return
    words = text.split()
    for word in words:
        number = _number(word)
        if isnan(number) or not (isfinite(number) or name in _LIMITS):
            raise _FaultError(f"{word!r} in {shown} is no finite number")
    if len(words) not in counts[name]:
        raise _FaultError(f"{shown} has {len(words)} numbers, not {' or '.join(map(str, counts[name]))}")


def _number(word: str) -> float:
    """The number that a word is, NaN if it is none."""
    try:
        return float(word) if "_" not in word else float("nan")
    except ValueError:
        return float("nan")
