"""Each law of docs/equations.md is the function that runs: what uses a law changes with the law.

A second copy of a formula, in a block, in the planner or in the compiled loop, would not change with the law.
"""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]
EQUATIONS = (ROOT / "docs" / "equations.md").read_text(encoding="utf-8")
LAWS = sorted(
    set(re.findall(r"`(laws/\w+)\.py: (\w+)`", EQUATIONS.split("## ")[0])) - {("laws/gains", "FixedGains")}
)

MOTION = {
    "energy_margin",
    "tracking_energy",
    "governed_acceleration",
    "governor_velocity",
    "driving_margin",
    "speed_damping",
    "limited_row",
    "axis_bounds",
    "track_axis",
}
"""Laws of how the object and the axes move; planner and loop need them."""

READINESS = {"clearance_margin", "interval_margin", "axis_ready"}
"""Laws of when a cell may be left."""

USERS = {
    "named": MOTION | READINESS | {"wrench_share", "acceleration_at", "estimate_object", "robot_effort"},
    "compiled": MOTION | READINESS | {"wrench_share", "acceleration_at", "estimate_object", "robot_effort"},
    "estimate": MOTION | READINESS,
    "stall": {"energy_margin", "tracking_energy", "axis_bounds", "track_axis"} | READINESS,
}
"""What must change with a law."""


@pytest.fixture(scope="module")
def changed():
    """For each law the results that changed with it, computed where laws are plain Python functions."""
    names = [f"coop_drake.{module.replace('/', '.')}:{name}" for module, name in LAWS]
    names.append("coop_drake.laws.readiness:axis_ready")
    done = subprocess.run(
        [sys.executable, "-m", "tests.support.changed_laws", *names],
        cwd=ROOT, env={**os.environ, "NUMBA_DISABLE_JIT": "1"}, capture_output=True, text=True, check=True,
    )  # fmt: skip
    return {name.split(":")[1]: set(results) for name, results in json.loads(done.stdout).items()}


def test_the_table_of_equations_names_the_laws_of_the_loop():
    assert {name for _, name in LAWS} | {"axis_ready"} == USERS["named"]


@pytest.mark.parametrize("user", sorted(USERS))
def test_changes_of_laws_reach(changed, user):
    assert {law for law, results in changed.items() if user in results} == USERS[user]
