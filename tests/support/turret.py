"""Two turrets carry the object: robots whose one joint has no limits, in an open hall."""

from __future__ import annotations

from pathlib import Path

URDF = """<robot name="turret">
<link name="base"><inertial><mass value="20"/>
 <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
 <collision><origin xyz="-0.35 0 0.2"/><geometry><box size="1.2 0.4 0.3"/></geometry></collision></link>
<link name="arm"><inertial><mass value="1"/>
 <inertia ixx=".01" iyy=".01" izz=".01" ixy="0" ixz="0" iyz="0"/></inertial>
 <collision><origin xyz="-0.35 0 0"/><geometry><box size=".7 .08 .08"/></geometry></collision></link>
<joint name="turret_joint" type="{kind}"><parent link="base"/><child link="arm"/><origin xyz="0 0 .4"/>
 <axis xyz="0 0 1"/><limit effort="100" velocity="2" {limits}/></joint>
<link name="gripper"/><joint name="hand" type="fixed"><parent link="arm"/><child link="gripper"/>
 <origin xyz="-0.7 0 0"/></joint>
</robot>
"""

SCENARIO = """workspace: {{outer: [[0, 0], [12, 0], [12, 12], [0, 12]]}}
directives:
- add_model: {{name: object, file: package://coop_drake_models/object.sdf}}
- add_model: {{name: robot_0, file: turret.urdf}}
- add_model: {{name: robot_1, file: turret.urdf}}
- add_weld: {{parent: object::grasp_0, child: robot_0::gripper}}
- add_weld: {{parent: object::grasp_1, child: robot_1::gripper}}
object: object
start: {{object: {{x: 6, y: 6, theta: 0}}, joints: {{robot_0: [{start}], robot_1: [{start}]}}}}
goal:
  object: {{x: 6.5, y: 6, theta: 0.2}}
  joints: {{robot_0: [{goal}], robot_1: [null]}}
  tolerances: {{position: 0.02, angle: 0.02}}
limits: {{"*": {{base_speed: 7, base_turn_rate: 8}}}}
{more}
"""


def write_turret(
    folder: Path,
    start: float = 3.0,
    goal: float = -3.1,
    *,
    kind: str = "continuous",
    limits: str = "",
    more: str = "",
) -> Path:
    """Write the scenario and the robot's model; returns the scenario's path."""
    (folder / "turret.urdf").write_text(URDF.format(kind=kind, limits=limits))
    path = folder / "turret.scenario.yaml"
    path.write_text(SCENARIO.format(start=start, goal=goal, more=more))
    return path
