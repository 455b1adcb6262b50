"""The exceptions that coop_drake raises on purpose; each has its data as attributes."""

from __future__ import annotations

import pickle
import traceback
from collections.abc import Iterable, Sequence

_LONGEST_VALUE = 200
"""Characters of a value that a message shows; a whole section of a file would fill the screen."""

_MOST_FAULTS = 20
"""Faults of a file that a message lists."""


class Finding(str):
    """What was found in place of a value, such as ``no such file``; messages show it without quotes."""

    def __repr__(self) -> str:
        return str(self)


def shortened(value: object) -> str:
    """Return a value as text for a message, shortened if it is long."""
    text = repr(value)
    return text if len(text) <= _LONGEST_VALUE else f"{text[:_LONGEST_VALUE]}…"


class CoopDrakeError(Exception):
    """Base of all exceptions raised on purpose by coop_drake."""


def transferable(error: Exception) -> Exception:
    """Return an error that another process can raise, with the traceback as a note.

    Where the error cannot be pickled, it is another one with the same message.
    """
    notes = traceback.format_exception(error)
    try:
        copy: Exception = pickle.loads(pickle.dumps(error))
    except Exception:
        copy = CoopDrakeError(str(error)) if isinstance(error, CoopDrakeError) else RuntimeError(repr(error))
    copy.add_note("".join(notes))
    return copy


class ScenarioError(CoopDrakeError):
    """A file is wrong; the message names the file, the key, the value and what is allowed.

    Args:
        file: Path of the offending file as the user wrote it.
        key: Dotted path of the key inside the file, for example ``workspace.outer[3]``.
        value: The offending value as it stands in the file.
        allowed: What may stand there, for example ``a ring that does not cross itself``.
        others: What else is wrong in the file, each as (key, value, allowed).
    """

    def __init__(
        self, file: str, key: str, value: object, allowed: str, others: Sequence[tuple[str, object, str]] = ()
    ) -> None:
        self.file, self.key, self.value, self.allowed, self.others = file, key, value, allowed, tuple(others)
        lines = [
            f"{file}: {place}: {shortened(found)}{'' if isinstance(found, Finding) else ' is not allowed'}; "
            f"expected {wanted}"
            for place, found, wanted in ((key, value, allowed), *self.others[: _MOST_FAULTS - 1])
        ]
        more = len(self.others) + 1 - _MOST_FAULTS
        super().__init__("\n".join(lines + [f"{file}: and {more} more"] * (more > 0)))

    @classmethod
    def of(cls, file: str, faults: Iterable[tuple[str, object, str]]) -> ScenarioError:
        """Return the error of a file with one or more faults, each as (key, value, allowed)."""
        first, *others = ((key or "the file", *rest) for key, *rest in faults)
        return cls(file, *first, others)  # type: ignore[arg-type, call-arg]

    @property
    def shown(self) -> str:
        """The offending value as text, shortened if it is long."""
        return shortened(self.value)

    def __reduce__(self) -> tuple[type[ScenarioError], tuple[object, ...]]:
        """Pickle the data instead of the message, so that the error can come from another process."""
        return type(self), (self.file, self.key, self.value, self.allowed, self.others)


class FloorPlanError(CoopDrakeError):
    """A drawing or a map gives no floor; the message names the file, the place, the mistake and the remedy.

    Args:
        file: Path of the offending file as the user wrote it.
        place: Place in the file: a line, an element, a key, or coordinates in W.
        finding: What is wrong there.
        remedy: What to do about it.
    """

    def __init__(self, file: str, place: str, finding: str, remedy: str) -> None:
        self.file, self.place, self.finding, self.remedy = file, place, finding, remedy
        super().__init__(f"{file}: {place}: {finding}; {remedy}")

    def __reduce__(self) -> tuple[type[FloorPlanError], tuple[str, str, str, str]]:
        """Pickle the data instead of the message, so that the error can come from another process."""
        return type(self), (self.file, self.place, self.finding, self.remedy)


class GeometryError(CoopDrakeError):
    """A shape cannot be used; the message names the shape and the place."""


class PlanError(CoopDrakeError):
    """A plan or a plan file is not usable, or does not belong to the scenario."""


class PatienceError(CoopDrakeError):
    """Raised by a progress function: the planner shall not look for a better plan than the one it has."""


class FieldError(CoopDrakeError):
    """A harmonic map cannot be built, or its error is too large; the message names the place."""


class StallError(CoopDrakeError):
    """A transition would take unreasonably long; the message names the passage."""


class TooQuickError(StallError):
    """In a transition a limit of acceleration would act; the message names the joint."""


class TooSlowError(StallError):
    """Within a limit the motion of a cell would take too long; the message names the limit's key."""


class RefusalError(CoopDrakeError):
    """A plan, a proof or a log does not hold; the message says where and what is wrong there, with numbers.

    Args:
        where: The place in the document, for example ``cells[3].tidied``, or in the log, ``joints[12, 1]``.
        finding: What is wrong there.
    """

    def __init__(self, where: str, finding: str) -> None:
        self.where, self.finding = where, finding
        super().__init__(f"{where}: {finding}")


class ProcessError(CoopDrakeError):
    """A process that works for a command was ended before it was done; the message names it."""


class MessagingError(CoopDrakeError):
    """Processes cannot speak with each other, or one is missing; the message says which, and why."""


class TuningError(CoopDrakeError):
    """The options of tuning are wrong, or its optimizer is missing; the message says what is expected."""
