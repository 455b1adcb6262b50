"""How the planner answered random questions: verdicts, wrong answers and times."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from coop_drake.campaign.report.distributions import Distribution, distribution


@dataclass(frozen=True)
class Questions:
    """The questions of one kind, or all of them.

    Attributes:
        kind: The kind, such as that of the floor; ``all`` for the last row.
        count: Questions asked.
        plans: Answered with a plan.
        infeasible: Answered with a proof that there is none.
        undecided: Answered with neither.
        refused: Answers that the exact checker refused.
        contradicted: Proofs of infeasibility although another planner found a way.
        peer_found: Undecided questions for which another planner found a way.
        seconds: CPU time of the answers [s].
    """

    kind: str
    count: int
    plans: int
    infeasible: int
    undecided: int
    refused: int
    contradicted: int
    peer_found: int
    seconds: Distribution

    @property
    def wrong(self) -> int:
        """Answers that are wrong or not proved."""
        return self.refused + self.contradicted


def summarise_questions(table: Any) -> tuple[Questions, ...]:
    """Return how the questions of every kind were answered, and all of them in the last row.

    Args:
        table: A pyarrow table with the columns of ``QuestionRecord``.
    """
    columns = {
        name: np.asarray(table[name].to_pylist())
        for name in ("kind", "verdict", "verified", "peer_found", "cpu_seconds")
    }
    kinds = columns["kind"]
    chosen = {str(kind): kinds == kind for kind in np.unique(kinds)}
    rows = [*chosen.items(), ("all", np.ones(len(kinds), dtype=bool))]
    return tuple(_count(kind, {name: column[own] for name, column in columns.items()}) for kind, own in rows)


def _count(kind: str, columns: dict[str, np.ndarray]) -> Questions:
    plans, infeasible, undecided = (
        columns["verdict"] == verdict for verdict in ("plan", "infeasible", "undecided")
    )
    found = columns["peer_found"].astype(bool)
    refused = ~columns["verified"].astype(bool) & ~undecided
    seconds = distribution(columns["cpu_seconds"].astype(float))
    assert seconds is not None  # every question took some time
    counts = (plans, infeasible, undecided, refused, infeasible & found, undecided & found)
    a, b, c, d, e, f = (int(count.sum()) for count in counts)
    return Questions(kind, len(plans), a, b, c, d, e, f, seconds)
