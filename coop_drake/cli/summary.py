"""The closing table."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

__all__ = ["summary_rows"]

_ROWS: tuple[tuple[str, str, str], ...] = (
    ("answer", "answer", "{}"),
    ("cells", "cells", "{}"),
    ("slices made", "slices", "{}"),
    ("margin kept", "margin_m", "{:.3f} m"),
    ("narrowest neck", "narrowest_neck_m", "{:.3f} m"),
    ("gains", "gains", "{}"),
    ("estimated transport", "estimated_seconds", "{:.1f} s"),
    ("first plan certified after", "first_plan_cpu_seconds", "{:.2f} s"),
    ("planning took", "planning_wall_seconds", "{:.2f} s"),
    ("mapping took", "mapping_wall_seconds", "{:.2f} s"),
    ("maps read from the cache", "maps_read", "{}"),
    ("largest map residual", "max_map_residual", "{:.1e}"),
    ("unknowns of the largest map", "max_map_unknowns", "{}"),
    ("simulated", "simulated_seconds", "{:.2f} s"),
    ("simulating took", "simulation_wall_seconds", "{:.2f} s"),
    ("smallest clearance", "min_clearance_m", "{:.4f} m"),
    ("smallest energy margin", "min_delta_e", "{:.2e} m²/s²"),
    ("largest acceleration error", "max_acceleration_error", "{:.1e} m/s²"),
    ("largest wrench error", "max_wrench_error_n", "{:.1e} N"),
    ("largest grasp error", "max_grasp_error_m", "{:.1e} m"),
    ("messages between robots", "messages", "{}"),
    ("their payload", "message_bytes", "{} bytes"),
    ("peak base force", "peak_base_wrench_n", "{:.1f} N"),
    ("peak joint torque", "peak_joint_torque_nm", "{:.1f} N m"),
    ("final position error", "final_position_error_m", "{:.4f} m"),
    ("final angle error", "final_angle_error_rad", "{:.4f} rad"),
    ("peak memory", "peak_memory_mb", "{:.0f} MB"),
)


def summary_rows(facts: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Return label and value of every fact that is known, in the table's order."""
    return [(label, form.format(facts[key])) for label, key, form in _ROWS if facts.get(key) is not None]
