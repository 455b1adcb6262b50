"""A task of the benchmark: some rows that are measured together."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from benchmarks.rows import Row

__all__ = ["Task", "chosen"]


@dataclass(frozen=True)
class Task:
    """Rows that are measured together.

    Attributes:
        name: What the names of its rows begin with or are about, as ``topic/.../item``.
        measure: Measures them.
    """

    name: str
    measure: Callable[[], list[Row]]


def chosen(tasks: list[Task], topics: list[str], only: list[str]) -> list[Task]:
    """Tasks of some topics, and of those the ones with a given part in their name.

    Args:
        tasks: All tasks.
        topics: First parts of names; none means all.
        only: Other parts of names, one of which must be there; none means any.
    """
    return [
        task
        for task in tasks
        if (not topics or task.name.split("/")[0] in topics)
        and (not only or not set(only).isdisjoint(task.name.split("/")[1:]))
    ]
