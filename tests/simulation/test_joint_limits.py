import logging
import subprocess
import sys

import pytest

from coop_drake.simulation.joint_limits import joint_limits_kept_by_funnels

# Drake warns once per process, at the first reaction force of a continuous plant whose joints have limits.
RUN = """
from dataclasses import replace
from coop_drake.simulation import simulate
from tests.support.small_loop import small_maps, small_problem
scenario, plan = small_problem("base")
assert simulate(replace(scenario, simulator=replace(scenario.simulator, max_time=0.01)), plan, small_maps())
"""


@pytest.fixture
def heard(caplog):
    logger = logging.getLogger("drake")
    logger.addHandler(caplog.handler)
    yield lambda: [record.getMessage() for record in caplog.records]
    logger.removeHandler(caplog.handler)


def test_a_run_does_not_alarm_about_limits_that_the_funnels_keep():
    run = subprocess.run([sys.executable, "-c", RUN], capture_output=True, text=True, check=True)
    assert "joint limits" not in run.stderr


def test_other_warnings_are_heard_and_afterwards_all(heard):
    limits = "Currently MultibodyPlant does not handle joint limits for continuous models. However some"
    logger = logging.getLogger("drake")
    with joint_limits_kept_by_funnels():
        logger.warning("anything else")
        logger.warning(limits)
    assert set(heard()) == {"anything else"}
    logger.warning(limits)
    assert limits in heard()
