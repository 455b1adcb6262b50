"""Slices of axes that begin a cell anew where they rest."""

import numpy as np
import pytest

from coop_drake.laws.axis_table import ENERGY_BOUND, SLICE_LOWER, SLICE_UPPER, track_row
from coop_drake.laws.beginning import widen_slice
from coop_drake.systems import axis_laws
from tests.support.small_loop import small_problem

ROW = axis_laws(small_problem("base")[1], [0])[1].table[0]
LOWER, UPPER = ROW[SLICE_LOWER], ROW[SLICE_UPPER]
WIDTH = UPPER - LOWER


def widened(position):
    wide = np.empty_like(ROW)
    return widen_slice(ROW, position, wide), wide


def test_an_axis_well_inside_keeps_its_slice():
    margin, wide = widened(0.5 * (LOWER + UPPER))
    assert margin > 0.0
    assert wide.tolist() == ROW.tolist()


@pytest.mark.parametrize("share", [-0.9, -0.3, -0.01, 0.01, 0.99, 1.01, 1.3, 1.9])
def test_an_axis_outside_or_at_an_end_gets_a_slice_in_which_its_energy_is_small_enough(share):
    position = LOWER + share * WIDTH
    margin, wide = widened(position)
    assert wide[SLICE_LOWER] < position < wide[SLICE_UPPER]
    assert wide[SLICE_LOWER] <= LOWER
    assert wide[SLICE_UPPER] >= UPPER
    assert margin >= 0.0
    assert track_row(wide, 0.0, position, 0.0)[1] <= ROW[ENERGY_BOUND]
    others = np.delete(wide, [SLICE_LOWER, SLICE_UPPER])
    assert others.tolist() == np.delete(ROW, [SLICE_LOWER, SLICE_UPPER]).tolist()


@pytest.mark.parametrize("share", [-1.1, 2.1])
def test_too_far_outside_no_slice_is_wide_enough(share):
    assert widened(LOWER + share * WIDTH)[0] < 0.0
