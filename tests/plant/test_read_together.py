"""Models read in one document make the plant that Drake's own directives make."""

from pathlib import Path

import numpy as np
import pytest
from pydrake.geometry import Role
from pydrake.multibody.parsing import AddModel, ModelDirective, Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import BodyIndex, FrameIndex, JointIndex, ModelInstanceIndex
from pydrake.systems.framework import DiagramBuilder

from coop_drake.errors import ScenarioError
from coop_drake.plant import build_team_plant, processing
from coop_drake.plant.read_together import read_together
from coop_drake.scenario import load_scenario
from coop_drake.shipped import SHIPPED

LINK = '<link name="base"><inertial><mass>{mass}</mass></inertial>{more}</link>'
MESH = '<visual name="v"><geometry><mesh><uri>base.obj</uri></mesh></geometry></visual>'


def described(team):
    """Everything that a reader of models puts into a plant and its geometry."""
    plant, inspector = team.plant, team.scene_graph.model_inspector()
    context = plant.CreateDefaultContext()
    frames = [plant.get_frame(FrameIndex(i)) for i in range(plant.num_frames())]
    joints = [plant.get_joint(JointIndex(i)) for i in range(plant.num_joints())]
    bodies = [plant.get_body(BodyIndex(i)) for i in range(1, plant.num_bodies())]
    return [
        [plant.GetModelInstanceName(ModelInstanceIndex(i)) for i in range(plant.num_model_instances())],
        [(f.scoped_name().get_full(), f.CalcPoseInWorld(context).GetAsMatrix4().tolist()) for f in frames],
        [(b.name(), b.default_spatial_inertia().CopyToFullMatrix6().tolist()) for b in bodies],
        [
            (
                j.name(),
                j.type_name(),
                j.position_lower_limits().tolist(),
                j.GetDampingVector(context).tolist(),
            )
            for j in joints
        ],
        [
            (
                inspector.GetName(g),
                inspector.GetPoseInFrame(g).GetAsMatrix4().tolist(),
                *(str(inspector.GetProperties(g, role)) for role in (Role.kIllustration, Role.kProximity)),
            )
            for g in inspector.GetAllGeometryIds()
        ],
        len(inspector.GetCollisionCandidates()),
    ]


@pytest.mark.parametrize("name", ["base", "elbow", "three"])
def test_a_team_is_the_one_that_directives_make(name, monkeypatch):
    scenario = load_scenario(str(SHIPPED / f"{name}.scenario.yaml"))
    done = []

    def watched(directives, parser):
        done.append(read_together(directives, parser))
        return done[-1]

    monkeypatch.setattr(processing, "read_together", watched)
    together = described(build_team_plant(scenario, DiagramBuilder()))
    assert done == [True]
    monkeypatch.setattr(processing, "read_together", lambda directives, parser: False)
    assert together == described(build_team_plant(scenario, DiagramBuilder()))


def directive(folder: Path, text: str, name="robot", file="model.sdf", **more):
    (folder / file).write_text(text, encoding="utf-8")
    return ModelDirective(add_model=AddModel(name=name, file=f"file://{folder / file}", **more))


def sdf(mass=1.0, more=""):
    return f'<sdf version="1.9"><model name="m">{LINK.format(mass=mass, more=more)}</model></sdf>'


def test_what_needs_more_than_its_file_is_left_to_directives(tmp_path):
    plant = MultibodyPlant(0.0)
    for held_back in (
        directive(tmp_path, sdf(more=MESH), file="with_mesh.sdf"),
        directive(tmp_path, sdf(), name="a::b"),
        directive(tmp_path, "<robot name='r'><link name='base'/></robot>", file="model.urdf"),
        directive(tmp_path, sdf(), default_joint_positions={"joint": np.zeros(1)}),
    ):
        assert not read_together([held_back], Parser(plant))
    assert plant.num_bodies() == 1


def test_a_refusal_is_in_drakes_words_about_the_file(tmp_path):
    text = (SHIPPED / "base.scenario.yaml").read_text(encoding="utf-8")
    (tmp_path / "model.sdf").write_text(sdf(mass=-1.0), encoding="utf-8")
    file = tmp_path / "bad.scenario.yaml"
    file.write_text(text.replace("package://coop_drake_models/object.sdf", "model.sdf"), encoding="utf-8")
    with pytest.raises(ScenarioError) as refusal:
        build_team_plant(load_scenario(str(file)), DiagramBuilder())
    assert str(tmp_path / "model.sdf") in str(refusal.value)
    assert "<include>" not in str(refusal.value)
