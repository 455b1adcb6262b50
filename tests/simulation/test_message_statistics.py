from dataclasses import replace

import numpy as np
import pytest

from coop_drake.simulation import communication
from tests.support.cases import case
from tests.support.synthetic_log import synthetic_log


def run(cells, *robots):
    """A log in which robots have these margins at steps in these cells."""
    log = synthetic_log(case("base"), samples=len(cells))
    return replace(log, cell_index=np.array(cells), ready_margins=np.array(robots, dtype=float).T)


def test_each_robot_reports_once_a_cell_and_hears_once_of_every_new_cell():
    statistics = communication(run([0, 0, 1, 1], [-1, 0, -1, 1], [2, 2, -1, 3]))
    assert statistics.reports == (2, 2)
    assert statistics.announcements == 2
    assert statistics.messages == 6


def test_what_is_taken_back_is_told_too():
    assert communication(run([0] * 5, [-1, 1, -1, -2, 1], [-1] * 5)).reports == (3, 0)


def test_a_robot_that_is_ready_on_entry_says_so_again():
    assert communication(run([0, 0, 1], [1, 1, 1], [-1, 1, -1])).reports == (2, 1)


@pytest.mark.parametrize("margin", [1.0, -1.0])
def test_a_run_that_never_leaves_its_first_cell(margin):
    statistics = communication(run([0, 0], [margin, margin], [-1.0, -1.0]))
    assert (statistics.reports, statistics.announcements) == ((int(margin > 0), 0), 0)
