import logging
import subprocess
import sys
from dataclasses import replace

import pytest
from pydrake.systems.framework import DiagramBuilder

from coop_drake.planning.planner import plan
from coop_drake.plant import build_team_plant, planning_problem
from coop_drake.simulation import build_maps, simulate
from coop_drake.simulation.run import joint_limits_kept_by_funnels
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
    found = plan(problem, at_limit.gain_sets["scheduled"], gain_set_name="scheduled").plan
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
