"""Errata EA1 and EA2: when the paper's exploration gives up, and which cells its heuristic follows."""

from dataclasses import replace

import pytest

from coop_drake.planning.cells import as_printed
from coop_drake.planning.cells.as_printed import PaperExploration
from coop_drake.planning.cells.exploration import Verdict
from tests.planning.test_search import rod_problem


def explored(problem, budget=400):
    exploration = PaperExploration(problem)
    return exploration, exploration.run(budget)


def printed_refine(path, source, goal, under):
    """Algorithm 2 with all under-cells of a slice, wherever the path passes it."""
    if len(path) == 1:
        return [path[0].slice]
    cells = goal if len(path) == 2 else under.by_slice[path[1].slice]
    connected = [cell for cell in cells if any(one.region.meets(cell.region) for one in source)]
    if connected:
        return printed_refine(path[1:], connected, goal, under)
    return [path[0].slice, path[1].slice]


def test_ea1_what_touches_is_subdivided_for_ever():
    problem = rod_problem(0.2)  # As wide as the rod: over-cells always join, under-cells never do.
    _, outcome = explored(problem)
    assert outcome.verdict is Verdict.RESOLUTION
    finer = replace(problem, settings=replace(problem.settings, angle_resolution=1e-6))
    _, longer = explored(finer)
    assert longer.slices > outcome.slices
    assert longer.verdict is not Verdict.FOUND


def test_ea2_cells_beside_the_path_lead_the_heuristic_to_the_wrong_slices(monkeypatch):
    problem = rod_problem(0.5)
    _, outcome = explored(problem)
    assert outcome.verdict is Verdict.FOUND
    monkeypatch.setattr(as_printed, "refine", printed_refine)
    stuck, outcome = explored(problem)
    assert outcome.verdict is Verdict.RESOLUTION
    widths = {
        upper - lower for ((lower, upper),) in (stuck.slices.all[c.slice].intervals for c in outcome.path)
    }
    assert max(widths) > 100.0 * min(
        widths
    )  # The goal's slices are as fine as allowed, the corridor's coarse.


@pytest.mark.parametrize("corridor", [0.23, 0.3, 1.0])
def test_the_corrected_heuristic_finds_the_way(corridor):
    assert explored(rod_problem(corridor))[1].verdict is Verdict.FOUND
