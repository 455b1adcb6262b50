"""What a predictor buys where measurements are late, and an observer where something pushes."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from coop_drake.diagram import build_closed_loop
from coop_drake.scenario import Control, Deployment, Floor, Measurements, Push
from coop_drake.simulation import simulate
from tests.support.small_loop import joint_names, small_maps
from tests.support.small_plan import small_plan
from tests.support.small_scenario import small_scenario

pytestmark = pytest.mark.slow

NONE, PREDICTOR, OBSERVER = Control(), Control(predictor=True), Control(observer=True)
LATE = Measurements(delay=0.04)


def problem(deployment, control):
    """Scenario and plan, with the gains that go with the deployment."""
    scenario = replace(small_scenario("base"), deployment=deployment, control=control)
    return scenario, small_plan(joint_names(scenario), scenario.gain_sets["scheduled"])


@cache
def run(departure, control=NONE, max_time=6.0):
    deployment = {
        "none": Deployment(control_rate=200.0),
        "delay": Deployment(control_rate=200.0, measurements=LATE),
        "friction": Deployment(control_rate=200.0, floor=Floor(coulomb_friction=50.0)),
        "slope": Deployment(control_rate=200.0, floor=Floor(slope=0.1)),
        "push": Deployment(control_rate=200.0, pushes=(Push("object", (50.0, 0.0), 1.2, 2.0),)),
    }[departure]
    scenario, plan = problem(deployment, control)
    scenario = replace(scenario, simulator=replace(scenario.simulator, max_time=max_time))
    return simulate(scenario, plan, small_maps())


def test_with_the_model_exact_a_predictor_knows_the_present():
    scenario, plan = problem(Deployment(control_rate=200.0, measurements=LATE), PREDICTOR)
    loop = build_closed_loop(scenario, plan, small_maps())
    simulator, errors = Simulator(loop.diagram, loop.create_context()), []
    station, law = loop.station.diagram, loop.bare_controllers[0]
    for time in np.arange(0.0, 1.2, 0.05):
        simulator.AdvanceTo(max(time - 1e-9, 0.0))  # just before the controllers compute again
        root = simulator.get_context()
        pose = station.GetOutputPort("object_pose").Eval(station.GetMyContextFromRoot(root))
        known = law.GetOutputPort("object_state").Eval(law.GetMyContextFromRoot(root))[:3]
        late = law.GetInputPort("object_pose").Eval(law.GetMyContextFromRoot(root))
        errors.append([np.abs(known - pose).max(), np.abs(late - pose).max()])
    predicted, measured = np.max(errors, axis=0)
    assert measured > 0.03
    assert predicted < 0.02 * measured


def test_with_a_predictor_a_late_team_moves_as_one_that_is_not():
    late, predicted, prompt = run("delay"), run("delay", PREDICTOR), run("none")
    assert (late.reached, predicted.reached, prompt.reached) == (True, True, True)
    assert predicted.times[-1] == pytest.approx(prompt.times[-1], abs=0.1)
    assert late.times[-1] > prompt.times[-1] + 0.5


@pytest.mark.parametrize("departure", ["friction", "slope"])
def test_an_observer_arrives_where_the_law_alone_gets_stuck(departure):
    stuck, observed = run(departure, max_time=4.0), run(departure, OBSERVER)
    assert "waits until the object reaches its goal position" in stuck.violation
    assert observed.reached
    assert observed.violation == ""


def test_an_observer_gives_way_to_a_push_less():
    """In the last cell, where the governor rests at the goal."""
    away = []
    for control in (NONE, OBSERVER):
        log = run("push", control)
        pushed = (log.times > 2.5) & (log.times < 3.2)
        away.append(np.linalg.norm(log.object_pose[pushed, :2] - [5.2, 3.6], axis=1).max())
        assert log.reached
    assert away[1] < 0.3 * away[0]


def test_without_disturbance_or_delay_the_additions_change_nothing_to_speak_of():
    plain, added = run("none"), run("none", Control(predictor=True, observer=True))
    assert added.times[-1] == pytest.approx(plain.times[-1], abs=0.02)
    assert added.funnel_margin.min() == pytest.approx(plain.funnel_margin.min(), rel=0.02)
