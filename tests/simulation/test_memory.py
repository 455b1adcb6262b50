"""A run that has ended leaves nothing but its log."""

import gc
import weakref
from dataclasses import replace

import pytest
from pydrake.systems.framework import Diagram

from coop_drake.simulation import run, simulate
from tests.support.small_loop import small_maps, small_problem


def inside(diagram):
    """A diagram and everything in it."""
    yield diagram
    for system in diagram.GetSystems():
        yield from inside(system) if isinstance(system, Diagram) else [system]


def test_no_block_diagram_or_plant_outlives_its_run(monkeypatch):
    seen = []
    build = run.build_closed_loop

    def watched(*arguments, **options):
        loop = build(*arguments, **options)
        seen.extend(weakref.ref(system) for system in inside(loop.diagram))
        return loop

    monkeypatch.setattr(run, "build_closed_loop", watched)
    scenario, plan = small_problem("base")
    brief = replace(scenario, simulator=replace(scenario.simulator, max_time=0.05))
    maps = small_maps()
    gc.disable()  # What a run makes stays young, and the run itself has to find it.
    try:
        log = simulate(brief, plan, maps)
    finally:
        gc.enable()
    assert len(log.times) > 1
    assert len(seen) > 5
    assert [system().get_name() for system in seen if system() is not None] == []


def test_a_run_that_breaks_off_leaves_nothing_either(monkeypatch):
    seen = []
    build = run.build_closed_loop

    def watched(*arguments, **options):
        loop = build(*arguments, **options)
        seen.append(weakref.ref(loop.team.plant))
        return loop

    def stop(stage, part):
        raise KeyboardInterrupt

    monkeypatch.setattr(run, "build_closed_loop", watched)
    with pytest.raises(KeyboardInterrupt):
        simulate(*small_problem("base"), small_maps(), progress=stop)
    gc.collect()
    assert [plant for plant in seen if plant() is not None] == []
