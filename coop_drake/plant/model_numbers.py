"""Numbers in model files: how many stand where, and which words are some.

Drake's readers take ``1m`` for 1, the first three numbers of four, and a default for a colour that is none.
"""

from __future__ import annotations

from math import isfinite, isnan

__all__ = ["fault_of_attribute", "fault_of_text"]

_ONE, _THREE = (1,), (3,)
_INERTIA = dict.fromkeys(("mass", "ixx", "ixy", "ixz", "iyy", "iyz", "izz"), _ONE)
_SHAPES = {"radius": _ONE, "length": _ONE}
_LIMITS = dict.fromkeys(("lower", "upper", "effort", "velocity"), _ONE)
_SDF: dict[str, tuple[int, ...]] = {
    "pose": (6, 7),
    "size": (2, 3),
    "xyz": _THREE,
    "scale": _THREE,
    "damping": _ONE,
    **dict.fromkeys(("ambient", "diffuse", "specular", "emissive"), (3, 4)),
    **_INERTIA,
    **_SHAPES,
    **_LIMITS,
}
"""Elements of SDF that hold numbers only, and how many."""
_URDF: dict[str, tuple[int, ...]] = {
    "xyz": _THREE,
    "rpy": _THREE,
    "size": _THREE,
    "scale": (1, 3),
    "rgba": (4,),
    "value": _ONE,
    "damping": _ONE,
    "friction": _ONE,
    "multiplier": _ONE,
    "offset": _ONE,
    **_INERTIA,
    **_SHAPES,
    **_LIMITS,
}
"""Attributes of URDF that hold numbers only, and how many."""


def fault_of_text(element: str, text: str) -> str:
    """What is wrong with the text of an element of SDF, or nothing; an empty one has its default."""
    return _fault(f"<{element}>", text, _SDF[element], element) if element in _SDF and text.split() else ""


def fault_of_attribute(element: str, name: str, text: str) -> str:
    """What is wrong with an attribute of an element of URDF, or nothing."""
    return _fault(f"{name} of <{element}>", text, _URDF[name], name) if name in _URDF else ""


def _fault(shown: str, text: str, counts: tuple[int, ...], name: str) -> str:
    words = text.split()
    for word in words:
        number = _number(word)
        if number is None or isnan(number) or not (isfinite(number) or name in _LIMITS):
            return f"{word!r} in {shown} is no finite number"
    if len(words) not in counts:
        return f"{shown} has {len(words)} numbers, not {' or '.join(map(str, counts))}"
    return ""


def _number(word: str) -> float | None:
    try:
        return None if "_" in word else float(word)
    except ValueError:
        return None
