"""Random teams on random plans through the whole loop: every switch is certified, and every cell is left."""

import numpy as np
import pytest

from coop_drake.simulation import build_maps, simulate
from tests.support.hand_over import assert_certified
from tests.support.random_plan import random_plan
from tests.support.ring_team import PRISMATIC, REVOLUTE, ring_team
from tests.support.small_loop import joint_names
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
