import numpy as np
import pytest
from pydrake.systems.framework import DiagramBuilder

from coop_drake.plant import build_separate_team, build_team_plant, set_configuration
from coop_drake.systems import TeamSensor, build_separate_sensor
from tests.support.small_scenario import small_scenario
from tests.support.system_checks import evaluate, port_sizes


@pytest.fixture(scope="module", params=["base", "elbow"])
def teams(request):
    """The same team in both plants, in the same configuration, and each plant's state."""
    scenario = small_scenario(request.param)
    built = [build(scenario, DiagramBuilder()) for build in (build_separate_team, build_team_plant)]
    rng = np.random.default_rng(3)
    z, rates = rng.uniform(-0.7, 0.7, (2, 3 + len(built[0].joints)))
    states = []
    for team in built:
        context = team.plant.CreateDefaultContext()
        set_configuration(team, context, z, rates)
        states.append(team.plant.GetPositionsAndVelocities(context))
    return list(zip(built, states, strict=True))


def test_the_same_is_measured_in_both_plants(teams):
    (separate, state), (tree, tree_state) = teams
    sensor, of_tree = build_separate_sensor(separate), TeamSensor(tree)
    values = evaluate(of_tree, {"team_state": tree_state}, "measurements")
    expected = np.split(values, np.cumsum(of_tree.sizes)[:-1])
    names = ["object_pose", *(f"robot_{robot.index}_state" for robot in separate.robots)]
    assert port_sizes(sensor) == (
        {"team_state": separate.plant.num_multibody_states()},
        dict(zip(names, of_tree.sizes, strict=True)),
    )
    for name, value in zip(names, expected, strict=True):
        np.testing.assert_allclose(evaluate(sensor, {"team_state": state}, name), value, atol=1e-12)
