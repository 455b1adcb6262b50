"""A checker of plans and proofs in exact arithmetic, with nothing but the standard library."""

from typing import Any

from coop_drake.checking import plane
from coop_drake.checking.found import check_plan
from coop_drake.checking.infeasible import check_proof
from coop_drake.checking.plane import RefusedError
from coop_drake.checking.team import Question

__all__ = ["RefusedError", "check"]

STEPS, STEPS_EACH = 2 * 10**8, 2 * 10**6
"""Elementary steps that are allowed, a minute; and more for each cell or slice, a second at most [-]."""


def check(question: Any, answer: Any, progress: Any = lambda phase, share: None) -> list[tuple[str, int]]:
    """Check an answer to a question, both as ``json.load`` gives them; ``progress`` gets phase and fraction.

    Returns the statements that hold, each with how often it was checked. Raises ``RefusedError`` if one does
    not or is not shown in the allowed steps, or a document is not as the format says.
    """
    formats = {
        ("coop_drake plan", 6): (check_plan, "cells"),
        ("coop_drake proof of infeasibility", 4): (check_proof, "slices"),
    }
    try:
        checked, parts = formats[answer["format"], answer["version"]]
        plane.work_left[0] = STEPS + STEPS_EACH * len(answer[parts])
        found = checked(Question(question), answer, progress)
        return [(statement, count) for statement, count in found if count > 0]
    except (LookupError, TypeError, ValueError, AttributeError, RecursionError, MemoryError) as error:
        raise RefusedError(f"document: {type(error).__name__}: {str(error)[:200]}") from error
