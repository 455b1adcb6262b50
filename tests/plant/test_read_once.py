"""The models of a scenario are read once, and plants that are built from them share no state."""

import gc
import shutil
from weakref import ref

import numpy as np
import pytest
from pydrake.systems.framework import DiagramBuilder

from coop_drake.plant import build_robot_plant, build_team_plant, parsing, set_configuration
from coop_drake.scenario import load_scenario
from tests.support.edited_scenario import MODELS, shipped


@pytest.fixture
def readings(monkeypatch):
    """Receives an entry whenever Drake reads models."""
    made, read = [], parsing.ProcessModelDirectives

    def counted(directives, parser):
        made.append(len(directives.directives))
        return read(directives, parser)

    monkeypatch.setattr(parsing, "ProcessModelDirectives", counted)
    return made


def test_plants_of_one_scenario_are_read_once_and_move_apart(readings):
    scenario = shipped("base")
    first, second = (built(scenario) for _ in range(2))
    assert len(readings) == 1
    n = len(first[0].joints)
    z = np.linspace(0.1, 0.5, 3 + n)
    contexts = [diagram.CreateDefaultContext() for _, diagram in (first, second)]
    own = [
        team.plant.GetMyMutableContextFromRoot(c)
        for (team, _), c in zip((first, second), contexts, strict=True)
    ]
    set_configuration(first[0], own[0], z)
    np.testing.assert_array_equal(first[0].plant.GetPositions(own[0])[first[0].position_index], z)
    assert not second[0].plant.GetPositions(own[1]).any()
    for team, _ in (first, second):
        parts = [team.object_frame, team.object_joint, *team.joints, *(r.base_body for r in team.robots)]
        assert all(part.GetParentPlant() is team.plant for part in parts)


def built(scenario):
    builder = DiagramBuilder()
    team = build_team_plant(scenario, builder)
    return team, builder.Build()


def test_a_robot_that_errs_about_its_masses_leaves_other_robots_of_the_scenario_alone(readings):
    scenario = shipped("base")
    light, heavy = (build_robot_plant(scenario, 0) for _ in range(2))
    heavy.scale_masses(2.0)
    assert len(readings) == 1
    masses = [robot.plant.CalcTotalMass(robot.context) for robot in (light, heavy)]
    assert masses[1] == pytest.approx(2.0 * masses[0])


def test_a_scenario_that_is_loaded_again_reads_changed_models(tmp_path):
    for path in MODELS.iterdir():
        shutil.copy(path, tmp_path)
    before = build_team_plant(load_scenario(tmp_path / "base.scenario.yaml"), DiagramBuilder())
    model = tmp_path / "object.sdf"
    mass = before.object_inertia.mass
    model.write_text(model.read_text().replace(f"<mass>{mass:g}", f"<mass>{2 * mass:g}"))
    after = build_team_plant(load_scenario(tmp_path / "base.scenario.yaml"), DiagramBuilder())
    assert after.object_inertia.mass == pytest.approx(2.0 * mass)


def test_what_was_read_is_forgotten_with_the_scenario():
    scenario = shipped("base")
    build_robot_plant(scenario, 0)
    plant, scenario = ref(build_robot_plant(scenario, 0).plant), None
    gc.collect()
    assert plant() is None
