"""Cells as plans hand them over are mapped to 1e-8, and no more nodes are needed than elsewhere."""

from __future__ import annotations

import numpy as np
import pytest

from coop_drake.fields import HarmonicMap
from coop_drake.fields.boundary import sample_boundary
from tests.support.domains import inside
from tests.support.real_cells import REAL_CELLS


@pytest.mark.parametrize("question", REAL_CELLS.values(), ids=REAL_CELLS)
def test_a_real_cell_is_mapped_to_1e_8(question):
    mapped = HarmonicMap(*question, tolerance=1e-8)
    assert mapped.accuracy.error_estimate <= 1e-8
    assert sample_boundary(mapped, 301).residual.max() <= 1.5e-8
    assert np.linalg.det(mapped(inside(mapped.region, 2_000))[1]).min() > 0.0
