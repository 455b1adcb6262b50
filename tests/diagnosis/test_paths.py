"""Given paths are free, or not proved to be."""

import numpy as np
from shapely import Polygon, box

from coop_drake.answers.problem import PlanningProblem
from coop_drake.diagnosis.variants import is_free
from tests.support.cases import team_tree

PILLAR = box(4.0, 4.0, 9.0, 9.0)
FLOOR = Polygon(box(0.0, 0.0, 20.0, 20.0).exterior.coords, [PILLAR.exterior.coords])


def test_a_path_is_free_on_the_floor_and_not_inside_a_pillar_that_it_never_leaves():
    for x, free in ((12.0, True), (6.0, False)):
        start = np.array([x, 6.5, 0.0, 0.0])
        path = np.stack((start, start + np.array([0.5, 0.0, 0.1, 0.1])))
        problem = PlanningProblem(FLOOR, team_tree(1, 1), start, path[-1, :3], (None,))
        assert is_free(problem, path)[0] is free
