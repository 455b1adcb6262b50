"""The whole check of an answer to a question; also of files: ``python -m coop_drake.checking``."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from coop_drake.checking.found import check_plan
from coop_drake.checking.infeasible import check_proof
from coop_drake.checking.plane import RefusedError, work
from coop_drake.checking.team import Question

FORMATS = {("coop_drake plan", 3): check_plan, ("coop_drake proof of infeasibility", 2): check_proof}
"""What answers say they are, with their versions."""

WORK = 10**8
"""Elementary steps that are allowed: about a minute [-]."""


def check(
    question: Any, answer: Any, progress: Callable[[str, float], None] = lambda phase, share: None
) -> list[tuple[str, int]]:
    """Check an answer to a question.

    Args:
        question: The question's document, as ``json.load`` gives it.
        answer: The answer's document.
        progress: Called with a phase and the fraction of it that is done.

    Returns:
        The statements that hold, each with how often it was checked.

    Raises:
        RefusedError: A statement does not hold or is not shown, or a document is not as the format says.
    """
    work[0] = WORK
    try:
        found = FORMATS[answer["format"], answer["version"]](Question(question), answer, progress)
        return [(statement, count) for statement, count in found if count > 0]
    except (LookupError, TypeError, ValueError, AttributeError) as error:
        raise RefusedError(
            "document", f"is not as the format says: {type(error).__name__}: {str(error)[:200]}"
        ) from error


def main(arguments: Sequence[str]) -> int:
    """Check files; returns 0 if the answer holds, 1 if it is refused, 2 if files cannot be read."""
    try:
        documents = [json.loads(Path(name).read_text(encoding="utf-8")) for name in arguments]
        question, answer = (
            documents if len(documents) == 2 else (documents[0]["question"], documents[0]["answer"])
        )
    except (OSError, ValueError, LookupError, TypeError, RecursionError, MemoryError) as error:
        print(f"expected a question and an answer, two JSON files or one with both: {error}", file=sys.stderr)
        return 2
    try:
        for statement, count in check(question, answer, _show):
            print(f"{count:8} {statement}")
    except RefusedError as refusal:
        print(f"refused: {refusal}")
        return 1
    print("the answer holds")
    return 0


def _show(phase: str, share: float) -> None:
    if sys.stderr.isatty():
        print(f"\r{phase} {share:4.0%}", end="\n" if share == 1.0 else "", file=sys.stderr, flush=True)
