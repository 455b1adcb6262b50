"""Random teams on random plans through the whole loop: every switch is certified, and every cell is left."""

from dataclasses import replace

import numpy as np
import pytest

from coop_drake.laws import FixedGains
from coop_drake.simulation import build_maps, simulate
from tests.support.hand_over import assert_certified
from tests.support.random_plan import random_plan
from tests.support.ring_team import PRISMATIC, REVOLUTE, ring_team
from tests.support.small_loop import joint_names, small_maps, small_problem
from tests.support.small_scenario import in_open_room


@pytest.mark.parametrize("seed", range(2))
def test_no_switch_breaks_anything_and_none_is_waited_for_in_vain(seed, tmp_path):
    rng = np.random.default_rng(seed)
    arms = [tuple((REVOLUTE, PRISMATIC)[i] for i in rng.integers(0, 2, rng.integers(0, 3))) for _ in range(3)]
    scenario = in_open_room(ring_team(tmp_path, arms, seed, mass=rng.uniform(1.0, 30.0)))
    plan = random_plan(rng, joint_names(scenario), cells=3)
    log = simulate(scenario, plan, build_maps(plan))
    assert log.violation == ""
    assert log.reached
    assert log.energy_margin.min() >= 0.0
    assert log.funnel_margin.min() > 0.0
    assert_certified(plan, log)


@pytest.mark.slow
@pytest.mark.parametrize(("gain_set", "steps"), [(None, False), (FixedGains(), True)])
def test_forces_go_on_where_they_were_unless_gains_step_as_printed(gain_set, steps):
    """The change over a step that holds a switch, beside 1.5 times the largest of all others."""
    scenario, plan = small_problem("base", gain_set)
    short = replace(scenario, simulator=replace(scenario.simulator, max_step_size=0.002, max_time=2.5))
    log = simulate(short, plan, small_maps())
    efforts = np.concatenate(
        [log.base_wrenches[..., :2].reshape(len(log.times), -1), log.joint_torques], axis=1
    )
    changes = np.abs(np.diff(efforts, axis=0)).max(axis=1)
    switches = np.flatnonzero(np.diff(log.cell_index))
    assert len(switches) >= 1
    assert (changes[switches].max() > 1.5 * np.delete(changes, switches).max()) == steps
    if not steps:
        assert np.abs(efforts[0]).max() < 1e-6
