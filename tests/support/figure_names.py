"""Which figures a run leaves, as `tests/viz/test_figures.py` holds them."""

from __future__ import annotations

OF_EVERY_RUN = (
    "fig04_start_and_goal",
    "fig05_path",
    "fig06_position",
    "fig07_angle",
    "fig08_velocity",
    "fig09_angular_velocity",
    "fig12_force",
    "fig13_torque",
    "summary",
)
OF_TWO_ROBOTS = ("fig10_joints_robot_0", "fig11_joints_robot_1")
