"""The maps of a plan: side by side, the same to the last bit, refused with the cell's number."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from coop_drake.errors import FieldError
from coop_drake.harmonic_maps import MapStore
from coop_drake.simulation import build_maps
from coop_drake.simulation.maps import TOLERANCE
from tests.support.small_plan import small_plan


@pytest.fixture(scope="module")
def plan():
    return small_plan(())


def with_targets(plan, *indices):
    """The plan with targets outside of some cells."""
    transitions = list(plan.transitions)
    for index in indices:
        transitions[index] = replace(transitions[index], target=np.array([0.1, 0.1]))
    return replace(plan, transitions=tuple(transitions))


def bits(maps):
    """Everything that evaluating maps depends on, as bytes."""
    return [a_map.solution.flat.tobytes() for a_map in maps]


def test_every_map_is_accurate_to_the_tolerance(plan):
    assert max(a_map.accuracy.error_estimate for a_map in build_maps(plan)) <= TOLERANCE
    assert max(a_map.accuracy.error_estimate for a_map in build_maps(plan, tolerance=1e-9)) <= 1e-9


def test_workers_and_the_store_change_nothing(plan, tmp_path):
    one_by_one = bits(build_maps(plan, workers=1))
    assert bits(build_maps(plan, workers=4)) == one_by_one
    store = MapStore(tmp_path)
    assert bits(build_maps(plan, store=store)) == one_by_one
    assert bits(build_maps(plan, store=store)) == one_by_one
    assert store.found == len(plan.cells)


def test_progress_is_told_in_the_order_of_the_cells(plan):
    told = []
    build_maps(plan, progress=lambda stage, part: told.append((stage, part)))
    assert told == [("mapping", (k + 1) / len(plan.cells)) for k in range(len(plan.cells))]


def test_the_first_cell_that_cannot_be_mapped_is_named(plan):
    with pytest.raises(FieldError, match="cell 1 of 3: "):
        build_maps(with_targets(plan, 1, 2))
    with pytest.raises(FieldError, match=r"cell 0 of 3: .*accurate to about"):
        build_maps(plan, tolerance=1e-17)


def test_an_interrupt_ends_the_building(plan):
    def interrupt(stage, part):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        build_maps(plan, progress=interrupt)
