"""Rings that enclose no floor are refused at the corner to blame."""

import pytest

from coop_drake.errors import ScenarioError
from coop_drake.scenario import load_scenario
from tests.support.scenarios import write_scenario

SQUARE = [[0, 0], [6, 0], [6, 4], [0, 4]]
PILLAR = [[1, 3], [1.5, 3], [1.5, 3.5], [1, 3.5]]

CASES = {
    "bow tie": ([[0, 0], [6, 4], [6, 0], [0, 4]], [], "workspace.outer[0]", "corners 0 and 2 meet at (3, 2)"),
    "spike": ([[0, 0], [6, 0], [6, 4], [6, 7], [6, 4], [0, 4]], [], "workspace.outer[1]", "touch itself"),
    "touching corner": ([[0, 0], [6, 0], [6, 4], [3, 0], [0, 4]], [], "workspace.outer[0]", "meet at (3, 0)"),
    "flat": ([[0, 0], [6, 0], [3, 0]], [], "workspace.outer[0]", "touch itself"),
    "speck": (
        [[0, 0], [1e-9, 0], [0, 1e-9]],
        [],
        "workspace.outer",
        "a ring with an area of 1e-09 m^2 or more",
    ),
    "two corners": ([[0, 0], [6, 0], [0, 0]], [], "workspace.outer", "three or more different corners"),
    "hole outside": (SQUARE, [[[8, 8], [9, 8], [9, 9]]], "workspace.holes[0]", "not outside it"),
    "hole across": (SQUARE, [[[5, 3], [7, 3], [7, 3.5]]], "workspace.holes[0]", "not across it"),
    "hole crosses itself": (
        SQUARE,
        [PILLAR, [[1, 1], [2, 2], [2, 1], [1, 2]]],
        "workspace.holes[1][0]",
        "meet at (1.5, 1.5)",
    ),
    "holes overlap": (
        SQUARE,
        [PILLAR, [[1.2, 3.2], [2, 3.2], [2, 3.8]]],
        "workspace.holes[1]",
        "a hole apart from workspace.holes[0]",
    ),
    "hole in a hole": (
        SQUARE,
        [PILLAR, [[1.1, 3.1], [1.3, 3.1], [1.3, 3.3]]],
        "workspace.holes[1]",
        "a hole apart from workspace.holes[0]",
    ),
    "holes that part the floor": (
        SQUARE,
        [[[0, 2], [3, 1], [3, 3]], [[6, 2], [3, 1], [3.0, 0.5]]],
        "workspace",
        "one piece",
    ),
}


@pytest.mark.parametrize("name", sorted(CASES))
def test_rings_that_enclose_no_floor_are_refused(name, tmp_path):
    outer, holes, key, allowed = CASES[name]
    path = write_scenario(tmp_path / "rings.scenario.yaml", workspace={"outer": outer, "holes": holes})
    with pytest.raises(ScenarioError) as caught:
        load_scenario(path)
    assert caught.value.key == key
    assert allowed in caught.value.allowed


@pytest.mark.parametrize("outer", [SQUARE, SQUARE[::-1], [*SQUARE, SQUARE[0]], [[0, 0], [3, 0], *SQUARE[1:]]])
def test_sense_closing_corner_and_straight_corners_do_not_matter(outer, tmp_path):
    path = write_scenario(tmp_path / "rings.scenario.yaml", workspace={"outer": outer, "holes": [PILLAR]})
    assert load_scenario(path).workspace.polygon.area == pytest.approx(23.75)
