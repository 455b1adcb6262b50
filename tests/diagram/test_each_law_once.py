"""Each law of docs/equations.md is the function that runs: blocks, compiled loop and planner call it.

A second copy of a formula, in a block, in the planner or in the compiled loop, would take the law's place.
"""

import ast
import re
from functools import cache
from pathlib import Path

import pytest

import coop_drake

ROOT = Path(coop_drake.__file__).parent
EQUATIONS = (ROOT.parent / "docs" / "equations.md").read_text(encoding="utf-8")
LAWS = set(re.findall(r"`laws/\w+\.py: (\w+)`", EQUATIONS.split("## ")[0])) - {"FixedGains"} | {"axis_ready"}

READINESS = {"clearance_margin", "interval_margin", "axis_ready"}
"""Laws of when a cell may be left."""

EFFORTS = {"wrench_share", "acceleration_at", "estimate_object", "robot_effort"}
"""Laws of what moves a robot, which neither the estimate of times nor that of a stall needs."""

USERS = {
    (
        "systems",
        "ReferenceGovernor",
        "AxisPpc",
        "WrenchLaw",
        "ObjectEstimator",
        "RobotEffort",
        "ReadyMonitor",
    ): LAWS,
    ("compiled_loop", "update", "watch"): LAWS,
    ("planning", "cross_cell"): LAWS - EFFORTS,
    ("simulation", "blocking_margin"): {"energy_margin", "tracking_energy", "axis_bounds", "track_axis"}
    | READINESS,
}
"""Where functions and blocks stand, and the laws that they must call, themselves or through others."""


@cache
def modules() -> dict[str, ast.Module]:
    """The package's modules by their names below ``coop_drake``, such as ``laws.ppc``."""
    return {
        ".".join(path.relative_to(ROOT).with_suffix("").parts): ast.parse(path.read_text(encoding="utf-8"))
        for path in ROOT.rglob("*.py")
        if path.name != "__init__.py"
    }


@cache
def known(module: str) -> dict[str, tuple[str, str]]:
    """Where functions and classes stand that a module defines or imports, by the names that it gives them."""
    found = {}
    for node in ast.walk(modules()[module]):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("coop_drake."):
            source = node.module.removeprefix("coop_drake.")
            for one in node.names:
                found[one.asname or one.name] = (source, one.name)
    return found | {one.name: (module, one.name) for one in modules()[module].body if hasattr(one, "name")}


def body_of(place: tuple[str, str]) -> tuple[str, ast.AST] | None:
    """The definition at a place, and its module; packages show what their modules define."""
    source, name = place
    for module in (
        [source] if source in modules() else [one for one in modules() if one.startswith(f"{source}.")]
    ):
        for one in modules()[module].body:
            if getattr(one, "name", None) == name:
                return module, one
    return None


def reached(user: str, names: set[str]) -> set[str]:
    """The laws that functions or blocks call, or that is called by what they call, and so on."""
    left, laws, seen = {(user, name) for name in names}, set(), set()
    while left:
        seen.add(place := left.pop())
        if (found := body_of(place)) is None:
            continue
        module, body = found
        laws |= {place[1]} if module.startswith("laws.") else set()
        for part in ast.walk(body):
            if isinstance(part, ast.Name) and part.id in known(module):
                left.add(known(module)[part.id])
            elif isinstance(part, ast.Attribute) and isinstance(part.value, ast.Name):
                source = known(module).get(part.value.id)
                if source is not None and ".".join(source) in modules():
                    left.add((".".join(source), part.attr))
        left -= seen
    return laws


@pytest.mark.parametrize("user", USERS, ids=lambda user: user[0])
def test_laws_are_called_and_not_written_again(user):
    assert len(LAWS) > 15
    assert LAWS & reached(user[0], set(user[1:])) == USERS[user]
