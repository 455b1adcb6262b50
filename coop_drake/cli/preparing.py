"""Work of a run that needs no plan, done by a thread while the planner searches."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from threading import Thread
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from coop_drake.scenario import Scenario


@contextmanager
def preparing(scenario: Scenario) -> Iterator[None]:
    """Import what simulating needs and read the models, beside the work of the block.

    The planner's kernels run without Python's global lock, half of the planner's time. What goes wrong here
    goes wrong again in the simulation, which reports it.

    Args:
        scenario: The one that will be simulated.
    """
    import coop_drake.planning.planner  # noqa: F401  # First: two threads that import wait for each other.

    thread = Thread(target=_prepare, args=(scenario,), daemon=True)
    thread.start()
    try:
        yield
    finally:
        thread.join()


def _prepare(scenario: Scenario) -> None:
    with suppress(Exception):
        from pydrake.systems.framework import DiagramBuilder

        from coop_drake import fields, simulation
        from coop_drake.plant import build_team_plant

        for module, name in ((simulation, "simulate"), (fields, "HarmonicMap")):
            getattr(module, name)
        build_team_plant(scenario, DiagramBuilder())
