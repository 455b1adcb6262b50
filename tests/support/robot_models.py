"""Texts of robot models for tests: SDF arms of any mounting, and one URDF."""

from __future__ import annotations

from dataclasses import dataclass, field

INERTIAL = (
    "<inertial><pose>{com}</pose><mass>{mass}</mass><inertia><ixx>{i}</ixx><iyy>{i}</iyy><izz>{i}</izz>"
    "<ixy>0</ixy><ixz>0</ixz><iyz>0</iyz></inertia></inertial>"
)
BAR = "<box><size>0.4 0.08 0.1</size></box>"
DISC = "<cylinder><radius>0.2</radius><length>0.4</length></cylinder>"


@dataclass(frozen=True)
class Arm:
    """A base, joints at the ends of links of 0.3 m, and a gripper frame at the end of the last link.

    Attributes:
        joints: For each joint its type, axis and extra content of ``<axis>``.
        roll: Roll of every joint frame [rad]; pi turns its z axis down.
        shapes: Collision shapes by link name, poses before them; bars if not given.
        extra: Further content of the model.
    """

    joints: tuple[tuple[str, str, str], ...] = (("revolute", "0 0 1", ""),)
    roll: float = 0.0
    shapes: dict[str, str] = field(default_factory=dict)
    extra: str = ""

    def text(self) -> str:
        """The SDF."""
        links = [self._link("base", 0.0, DISC, 6.0)]
        joints = []
        names = ["base", *(f"link_{i}" for i in range(1, len(self.joints) + 1))]
        for place, (kind, axis, more) in enumerate(self.joints):
            parent, child = names[place], names[place + 1]
            links.append(self._link(child, 0.3 * (place + 1), f"{BAR}", 1.0))
            limits = more or "<limit><lower>-1.2</lower><upper>1.5</upper></limit>"
            joints.append(
                f'<joint name="joint_{place}" type="{kind}"><pose>0 0 0 {self.roll} 0 0</pose>'
                f"<parent>{parent}</parent><child>{child}</child>"
                f"<axis><xyz>{axis}</xyz>{limits}</axis></joint>"
            )
        tip = "<pose>0.3 0 0 0 0 3.141592653589793</pose>"
        hand = f'<frame name="gripper" attached_to="{names[-1]}">{tip}</frame>'
        return (
            f'<sdf version="1.9"><model name="arm">{"".join(links + joints)}{hand}{self.extra}</model></sdf>'
        )

    def _link(self, name: str, x: float, shape: str, mass: float) -> str:
        at = "0.15 0 0 0 0 0" if name != "base" else "0 0 0 0 0 0"
        geometry = self.shapes.get(name, f"<pose>{at}</pose><geometry>{shape}</geometry>")
        inertial = INERTIAL.format(com=at, mass=mass, i=0.1 * mass)
        return (
            f'<link name="{name}"><pose>{x} 0 0.4 0 0 0</pose>{inertial}'
            f'<collision name="collision">{geometry}</collision></link>'
        )


URDF = """<robot name="urdf_arm">
  <link name="base">
    <inertial><mass value="6"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><geometry><cylinder radius="0.25" length="0.5"/></geometry></collision>
  </link>
  <link name="boom">
    <inertial><origin xyz="0.2 0 0"/><mass value="1"/>
      <inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><origin xyz="0 0.2 0"/><geometry><box size="0.1 0.4 0.1"/></geometry></collision>
  </link>
  <link name="slider">
    <inertial><origin xyz="0.2 0 0"/><mass value="1"/>
      <inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><origin xyz="0.15 0 0"/><geometry><sphere radius="0.1"/></geometry></collision>
  </link>
  <link name="gripper"/>
  <joint name="yaw" type="{yaw}">
    <parent link="base"/><child link="boom"/>
    <origin xyz="0.35 0 0" rpy="3.14159265358979 0 0"/><axis xyz="0 0 1"/>
    <limit lower="-1" upper="1.5" effort="0" velocity="1"/>{mimic}
  </joint>
  <joint name="reach" type="prismatic">
    <parent link="boom"/><child link="slider"/>
    <origin xyz="0 0.4 0" rpy="0 0 1.5707963"/><axis xyz="1 0 0"/>
    <limit lower="0" upper="0.3" effort="20" velocity="1"/>
  </joint>
  <joint name="wrist" type="fixed">
    <parent link="slider"/><child link="gripper"/>
    <origin xyz="0.3 0 0" rpy="3.14159265358979 0 3.14159265358979"/>
  </joint>
</robot>
"""


def urdf_arm(yaw: str = "revolute", mimic: str = "") -> str:
    """A URDF robot whose yaw joint hangs upside down, with a prismatic joint behind it."""
    return URDF.format(yaw=yaw, mimic=mimic)
