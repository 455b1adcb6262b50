"""Runs keep joints' limits and leave nothing but their log; maps of a plan are the same to the last bit."""

import gc
import logging
import subprocess
import sys
import weakref
from dataclasses import replace

import numpy as np
import pytest
from pydrake.systems.framework import Diagram, DiagramBuilder

from coop_drake.errors import FieldError
from coop_drake.harmonic_maps import MapStore
from coop_drake.planning import planner
from coop_drake.plant import build_team_plant, planning_problem
from coop_drake.simulation import build_maps, run, simulate
from coop_drake.simulation.maps import TOLERANCE
from coop_drake.simulation.run import joint_limits_kept_by_funnels
from tests.support.small_loop import small_maps, small_problem
from tests.support.small_plan import small_plan
from tests.support.small_scenario import small_scenario

# Drake warns once per process, at the first reaction force of a continuous plant whose joints have limits.
RUN = """
from dataclasses import replace
from coop_drake.simulation import simulate
from tests.support.small_loop import small_maps, small_problem
scenario, plan = small_problem("base")
assert simulate(replace(scenario, simulator=replace(scenario.simulator, max_time=0.01)), plan, small_maps())
"""


@pytest.fixture
def heard(monkeypatch):
    """What Drake's logger lets through from here on, whatever else was done to it in this process."""

    class Listener(logging.Handler):
        def emit(self, record):
            messages.append(record.getMessage())

    messages = []
    logger = logging.getLogger("drake")
    for name, value in {
        "disabled": False,
        "propagate": False,
        "handlers": [Listener()],
        "filters": [],
    }.items():
        monkeypatch.setattr(logger, name, value)
    level, switched_off = logger.level, logging.root.manager.disable
    logging.disable(logging.NOTSET)
    logger.setLevel(logging.WARNING)
    yield messages
    logger.setLevel(level)
    logging.disable(switched_off)


def test_a_run_does_not_alarm_about_limits_that_the_funnels_keep():
    run = subprocess.run([sys.executable, "-c", RUN], capture_output=True, text=True, check=True)
    assert "joint limits" not in run.stderr


def test_a_joint_that_starts_and_ends_at_its_limit_does_not_leave_it():
    """Its slice goes a little beyond, so that its funnel has two sides; the run does not go there."""
    scenario = small_scenario()
    limit = 1.87
    start = replace(scenario.start, joints={"robot_0": (limit,), "robot_1": (0.0,)})
    at_limit = replace(scenario, start=start, goal=replace(scenario.goal, joints={"robot_0": (limit,)}))
    problem = planning_problem(at_limit, build_team_plant(at_limit, DiagramBuilder()))
    found = planner.plan(problem, at_limit.gain_sets["scheduled"], gain_set_name="scheduled").plan
    assert max(cell.upper[1] for cell in found.cells) > limit
    log = simulate(at_limit, found, build_maps(found))
    assert log.reached
    assert log.joints[:, 0].max() <= limit


def test_other_warnings_are_heard_and_afterwards_all(heard):
    limits = "Currently MultibodyPlant does not handle joint limits for continuous models. However some"
    logger = logging.getLogger("drake")
    with joint_limits_kept_by_funnels():
        logger.warning("anything else")
        logger.warning(limits)
    logger.warning(limits)
    assert heard == ["anything else", limits]


@pytest.fixture(scope="module")
def plan():
    return small_plan(())


def with_targets(plan, *indices):
    """The plan with targets outside of some cells."""
    transitions = list(plan.transitions)
    for index in indices:
        transitions[index] = replace(transitions[index], target=np.array([0.1, 0.1]))
    return replace(plan, transitions=tuple(transitions))


def bits(maps):
    """Everything that evaluating maps depends on, as bytes."""
    return [a_map.solution.flat.tobytes() for a_map in maps]


def test_every_map_is_accurate_to_the_tolerance(plan):
    assert max(a_map.accuracy.error_estimate for a_map in build_maps(plan)) <= TOLERANCE
    assert max(a_map.accuracy.error_estimate for a_map in build_maps(plan, tolerance=1e-9)) <= 1e-9


def test_workers_and_the_store_change_nothing(plan, tmp_path):
    one_by_one = bits(build_maps(plan, workers=1))
    assert bits(build_maps(plan, workers=4)) == one_by_one
    store = MapStore(tmp_path)
    assert bits(build_maps(plan, store=store)) == one_by_one
    assert bits(build_maps(plan, store=store)) == one_by_one
    assert store.found == len(plan.cells)


def test_progress_is_told_in_the_order_of_the_cells(plan):
    told = []
    build_maps(plan, progress=lambda stage, part: told.append((stage, part)))
    assert told == [("mapping", (k + 1) / len(plan.cells)) for k in range(len(plan.cells))]


def test_the_first_cell_that_cannot_be_mapped_is_named(plan):
    with pytest.raises(FieldError, match="cell 1 of 3: "):
        build_maps(with_targets(plan, 1, 2))
    with pytest.raises(FieldError, match=r"cell 0 of 3: .*accurate to about"):
        build_maps(plan, tolerance=1e-17)


def test_an_interrupt_ends_the_building(plan):
    def interrupt(stage, part):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        build_maps(plan, progress=interrupt)


def inside(diagram):
    """A diagram and everything in it."""
    yield diagram
    for system in diagram.GetSystems():
        yield from inside(system) if isinstance(system, Diagram) else [system]


@pytest.fixture
def built(monkeypatch):
    """Weak references to every system of the loops that are built from here on."""
    seen, build = [], run.build_closed_loop

    def watched(*arguments, **options):
        loop = build(*arguments, **options)
        seen.extend(weakref.ref(system) for system in (*inside(loop.diagram), loop.team.plant))
        return loop

    monkeypatch.setattr(run, "build_closed_loop", watched)
    return seen


def test_no_block_diagram_or_plant_outlives_its_run(built):
    scenario, plan = small_problem("base")
    brief = replace(scenario, simulator=replace(scenario.simulator, max_time=0.05))
    maps = small_maps()
    gc.disable()  # What a run makes stays young, and the run itself has to find it.
    try:
        log = simulate(brief, plan, maps)
    finally:
        gc.enable()
    assert len(log.times) > 1
    assert len(built) > 5
    assert [system().get_name() for system in built if system() is not None] == []


def test_a_run_that_breaks_off_leaves_nothing_either(built):
    def stop(stage, part):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        simulate(*small_problem("base"), small_maps(), progress=stop)
    gc.collect()
    assert [system().get_name() for system in built if system() is not None] == []
