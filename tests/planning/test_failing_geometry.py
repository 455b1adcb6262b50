"""Geometry libraries that fail now and then: verdicts degrade to undecided, never to a wrong one."""

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from manifold3d import CrossSection
from shapely import Point, Polygon
from shapely.errors import GEOSException

from coop_drake.answers.problem import PlannerSettings
from coop_drake.geometry.minkowski import SAFE_SIDE, FreeSpace
from coop_drake.planning.cells.exploration import Exploration, Verdict
from coop_drake.planning.search import NoChannel, find_channel
from tests.geometry.test_minkowski import as_shapely, exact_difference
from tests.planning.test_search import rod_problem
from tests.support.trees import room

SQUARE = np.array([[-0.3, -0.2], [0.4, -0.2], [0.4, 0.3], [-0.3, 0.3]])
CLIPPED = FreeSpace._clipped


def raising(*arguments) -> CrossSection:
    raise RuntimeError("the clipping library gave up")


def topology_fails(*arguments):
    raise GEOSException("TopologyException: side location conflict")


def nothing(space: FreeSpace, footprint: np.ndarray) -> CrossSection:
    return CrossSection()


def everything(space: FreeSpace, footprint: np.ndarray) -> CrossSection:
    return CrossSection.square((50.0, 50.0), center=True)


def now_and_then(failure, every: int):
    """Clipping in which each so many-th difference fails."""
    calls = iter(range(1_000_000_000))
    return lambda space, footprint: (failure if next(calls) % every == 0 else CLIPPED)(space, footprint)


@pytest.mark.parametrize("failure", [raising, nothing, everything])
def test_a_failed_difference_frees_nothing_and_blocks_no_more_than_the_truth(monkeypatch, failure) -> None:
    monkeypatch.setattr(FreeSpace, "_clipped", failure)
    exact = exact_difference(room(), SQUARE)
    assert FreeSpace.under(room()).minus(SQUARE).is_empty()
    over = as_shapely(FreeSpace.over(room()).minus(SQUARE))
    assert over.covers(exact)
    assert over.symmetric_difference(exact).area < 1e-3


def test_where_both_libraries_fail_nothing_is_blocked(monkeypatch) -> None:
    monkeypatch.setattr(FreeSpace, "_clipped", raising)
    space, exact = FreeSpace.over(room()), exact_difference(room(), SQUARE)
    with monkeypatch.context() as broken:
        broken.setattr(shapely, "union_all", topology_fails)
        found = space.minus(SQUARE)
    assert as_shapely(found).covers(exact)


@pytest.mark.parametrize("distance", [SAFE_SIDE, -SAFE_SIDE])
@pytest.mark.parametrize("kind", ["raises", "is empty", "is far away"])
def test_a_failed_buffer_frees_nothing_and_blocks_nothing(monkeypatch, distance: float, kind: str) -> None:
    def fail(shape, distance, **options):
        if kind == "raises":
            topology_fails()
        return Polygon() if kind == "is empty" else Point(50.0, 50.0).buffer(1.0)

    with monkeypatch.context() as broken:
        broken.setattr(Polygon, "buffer", fail)
        space = FreeSpace.over(room()) if distance > 0.0 else FreeSpace.under(room())
    if distance < 0.0:
        assert space.minus(SQUARE).is_empty()
    else:
        assert as_shapely(space.minus(SQUARE)).covers(exact_difference(room(), SQUARE))


@settings(max_examples=12)
@given(st.sampled_from((raising, nothing, everything)), st.integers(1, 9), st.sampled_from((0.19, 0.3)))
def test_no_exploration_errs_however_often_clipping_fails(failure, every: int, corridor: float) -> None:
    problem = rod_problem(corridor)
    with pytest.MonkeyPatch.context() as broken:
        broken.setattr(FreeSpace, "_clipped", now_and_then(failure, every))
        outcome = Exploration(problem).run(250)
    assert outcome.verdict is not (Verdict.FOUND if corridor < 0.2 else Verdict.INFEASIBLE)


@pytest.mark.no_cover
@pytest.mark.parametrize("corridor", [0.19, 0.3])
def test_a_search_without_clipping_answers_nothing(monkeypatch, corridor: float) -> None:
    monkeypatch.setattr(FreeSpace, "_clipped", raising)
    monkeypatch.setattr(shapely, "symmetric_difference", topology_fails)
    channel, _ = find_channel(rod_problem(corridor, PlannerSettings(max_slices=32)))
    assert isinstance(channel, NoChannel)
    assert not channel.proved


def moved_and_doubled(section: CrossSection, *others: CrossSection) -> CrossSection:
    """A result that is too large to be right: what was put in, moved and doubled."""
    return section + section.translate((50.0, 0.0))


BROKEN = [
    ("__xor__", raising),
    ("__xor__", moved_and_doubled),
    ("decompose", raising),
    ("decompose", lambda section: []),
]


@settings(max_examples=10)
@given(st.sampled_from(BROKEN), st.integers(1, 9), st.sampled_from((0.19, 0.3)))
def test_no_exploration_errs_however_often_regions_cannot_be_cut_or_parted(
    broken, every: int, corridor: float
) -> None:
    name, failure = broken
    works, calls = getattr(CrossSection, name), iter(range(1_000_000_000))
    problem = rod_problem(corridor)
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(
            CrossSection, name, lambda *sections: (failure if next(calls) % every == 0 else works)(*sections)
        )
        outcome = Exploration(problem).run(200)
    assert outcome.verdict is not (Verdict.FOUND if corridor < 0.2 else Verdict.INFEASIBLE)


@pytest.mark.slow
@pytest.mark.no_cover
@pytest.mark.parametrize(("name", "failure"), BROKEN)
def test_a_search_that_cannot_cut_or_part_regions_never_errs(monkeypatch, name: str, failure) -> None:
    monkeypatch.setattr(CrossSection, name, failure)
    for corridor in (0.19, 0.3):
        answer, _ = find_channel(rod_problem(corridor, PlannerSettings(max_slices=32)))
        if corridor < 0.2:
            assert isinstance(answer, NoChannel)
        else:
            assert not (isinstance(answer, NoChannel) and answer.proved)
