"""Tasks of the benchmark: rows that are measured together, and who works through them."""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, as_completed, wait
from dataclasses import dataclass

from benchmarks.isolated import stop_all
from benchmarks.rows import Row
from coop_drake.errors import CoopDrakeError

Rows = Sequence[Row]
_POLL = 0.1


@dataclass(frozen=True)
class Task:
    """Rows that are measured together.

    Attributes:
        name: What the names of its rows begin with, as ``topic/.../item``.
        measure: Measures them; it is given the rows that are there already.
        alone: Whether nothing else may run on the machine at the same time. Tasks that share it with
            another one must do their work in processes of their own.
    """

    name: str
    measure: Callable[[Rows], Rows]
    alone: bool = False


@dataclass(frozen=True)
class Done:
    """A task that came to its end.

    Attributes:
        task: The task.
        rows: What it measured, nothing if it failed.
        error: Why it failed.
    """

    task: Task
    rows: Rows
    error: CoopDrakeError | None = None


def chosen(tasks: Sequence[Task], topics: Sequence[str], only: Sequence[str]) -> list[Task]:
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


def worked(tasks: Sequence[Task], rows: Callable[[], Rows], jobs: int) -> Generator[Done, None, None]:
    """Work through tasks: first those that may share the machine, then one by one those that may not.

    Args:
        tasks: What to do.
        rows: Gives the rows that are there.
        jobs: How many tasks share the machine.
    """
    shared = [task for task in tasks if not task.alone]
    with ThreadPoolExecutor(jobs) as pool:
        futures: list[Future[Done]] = [pool.submit(_done, task, rows) for task in shared]
        try:
            for future in as_completed(futures):
                yield future.result()
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            while wait(futures, timeout=_POLL).not_done:
                stop_all()
            raise
    for task in tasks:
        if task.alone:
            yield _done(task, rows)


def _done(task: Task, rows: Callable[[], Rows]) -> Done:
    try:
        return Done(task, task.measure(rows()))
    except CoopDrakeError as error:
        return Done(task, (), error)
