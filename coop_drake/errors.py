"""Every exception that coop_drake raises on purpose; each carries its data and says what is allowed."""

from __future__ import annotations

__all__ = [
    "CoopDrakeError",
    "FieldError",
    "FloorPlanError",
    "GeometryError",
    "PlanError",
    "RefusalError",
    "ScenarioError",
    "StallError",
    "TuningError",
    "UnmappableError",
]

_LONGEST_VALUE = 200
"""Characters of a value that a message shows."""


class CoopDrakeError(Exception):
    """Base of all exceptions raised on purpose by coop_drake."""


class ScenarioError(CoopDrakeError):
    """A file is wrong: says in which file, at which key, with which value, and what is allowed.

    Args:
        file: Path of the offending file as the user wrote it.
        key: Dotted path of the key inside the file, for example ``workspace.outer[3]``.
        value: The offending value as it stands in the file.
        allowed: What may stand there, for example ``a ring that does not cross itself``.
    """

    def __init__(self, file: str, key: str, value: object, allowed: str) -> None:
        self.file, self.key, self.value, self.allowed = file, key, value, allowed
        super().__init__(f"{file}: {key}: {self.shown} is not allowed; expected {allowed}")

    @property
    def shown(self) -> str:
        """The offending value, cut where a whole section of a file would fill the screen."""
        text = repr(self.value)
        return text if len(text) <= _LONGEST_VALUE else f"{text[:_LONGEST_VALUE]}…"

    def __reduce__(self) -> tuple[type[ScenarioError], tuple[str, str, object, str]]:
        """Pickle the data and not the message: files are read in a process of their own."""
        return type(self), (self.file, self.key, self.value, self.allowed)


class FloorPlanError(CoopDrakeError):
    """A drawing or a map that gives no floor: says in which file, where, what is wrong, and what helps.

    Args:
        file: Path of the offending file as the user wrote it.
        place: Where in it: a line, an element, a key, or coordinates in W.
        finding: What is wrong there.
        remedy: What would help.
    """

    def __init__(self, file: str, place: str, finding: str, remedy: str) -> None:
        self.file, self.place, self.finding, self.remedy = file, place, finding, remedy
        super().__init__(f"{file}: {place}: {finding}; {remedy}")

    def __reduce__(self) -> tuple[type[FloorPlanError], tuple[str, str, str, str]]:
        """Pickle the data and not the message: files are read in a process of their own."""
        return type(self), (self.file, self.place, self.finding, self.remedy)


class GeometryError(CoopDrakeError):
    """A shape cannot be used; the message names the shape and the place."""


class PlanError(CoopDrakeError):
    """A plan or a plan file is not usable, or does not belong to the scenario."""


class FieldError(CoopDrakeError):
    """A harmonic map cannot be built or its certificate failed; the message names the corner or gap."""


class UnmappableError(FieldError):
    """A shape that no map within the tolerance was found for: says which corner or gap is at fault.

    Args:
        message: What is wrong, in words that name the place.
        place: Where, in W, (x, y) [m].
        angle: Interior angle of the corner at fault [degrees], None for a gap.
        width: Width of the gap at fault [m], None for a corner.
    """

    def __init__(
        self,
        message: str,
        place: tuple[float, float],
        *,
        angle: float | None = None,
        width: float | None = None,
    ) -> None:
        self.place, self.angle, self.width = place, angle, width
        super().__init__(message)


class StallError(CoopDrakeError):
    """A transition would take unreasonably long; the message names the passage."""


class RefusalError(CoopDrakeError):
    """A plan or a proof does not hold: says where, what is wrong there, and by how much.

    Args:
        where: The place in the document, for example ``cells[3].safe``.
        finding: What is wrong there.
    """

    def __init__(self, where: str, finding: str) -> None:
        self.where, self.finding = where, finding
        super().__init__(f"{where}: {finding}")


class TuningError(CoopDrakeError):
    """What gains are to be chosen for, or by, makes no sense; the message says what is allowed."""
