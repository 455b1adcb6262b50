import numpy as np
import pytest
from shapely import Point, Polygon, box

from coop_drake.errors import FieldError, UnmappableError
from coop_drake.fields import HarmonicMap, solving
from tests.support import domains

ELL = Polygon([(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)])


@pytest.mark.parametrize(
    ("domain", "goal"),
    [
        domains.square(),
        domains.u_corridor(),
        domains.warehouse(),
        domains.needle(10),
        domains.blade(350),
        domains.two_rooms(0.01),
        domains.two_rooms(0.1),
        domains.bevelled(1e-3),
        domains.bevelled(1e-6),
        domains.rounded_room(),
    ],
    ids=lambda value: None,
)
def test_clean_and_nasty_domains_are_accurate(domain, goal):
    accuracy = HarmonicMap(domain, goal).accuracy
    holes = len(domain.interiors)
    assert accuracy.residual <= 1e-6
    assert accuracy.error_estimate == (2 * holes + 1) * accuracy.residual
    assert accuracy.samples > accuracy.unknowns
    assert 1.0 < accuracy.condition < 1e7


def test_more_is_spent_where_more_is_asked():
    plain, fine = HarmonicMap(ELL, Point(0.5, 0.5)), HarmonicMap(ELL, Point(0.5, 0.5), tolerance=2e-10)
    assert fine.accuracy.unknowns > plain.accuracy.unknowns
    assert fine.accuracy.error_estimate <= 2e-10 < plain.accuracy.error_estimate


def test_refusal_names_the_corner_at_fault():
    message = r"accurate to about .*; 1e-16 was asked for.*; at fault is the corner at \("
    with pytest.raises(FieldError, match=message):
        HarmonicMap(ELL, Point(0.5, 0.5), tolerance=1e-16)


@pytest.mark.parametrize("gap", [1e-6, 1e-7])
def test_a_gap_too_narrow_for_any_number_of_nodes_is_refused_at_the_first_attempt(monkeypatch, gap):
    attempts = []
    one_attempt = solving._solve
    monkeypatch.setattr(solving, "_solve", lambda *a: attempts.append(a[-1]) or one_attempt(*a))
    with pytest.raises(
        UnmappableError, match=r"and rounding alone may cost .*; at fault is the gap of"
    ) as caught:
        HarmonicMap(*domains.two_rooms(gap))
    assert len(attempts) == 1
    assert caught.value.width == pytest.approx(gap, rel=0.01)
    assert box(0.98, 0.49, 1.12, 0.51).contains(Point(caught.value.place))


def test_a_narrow_gap_that_does_no_harm_is_mapped():
    between_pillars = box(0, 0, 4, 3).difference(box(1, 1, 2, 2)).difference(box(2 + 1e-6, 1, 3, 2))
    accuracy = HarmonicMap(between_pillars, Point(3.5, 0.5)).accuracy
    assert accuracy.error_estimate <= 1e-8
    assert accuracy.condition * np.finfo(float).eps > 1e-8


def test_refusal_of_a_domain_too_fine_names_the_gap():
    comb = box(0, 0, 4, 1)
    for k in range(60):
        comb = comb.difference(box(0.05 + 0.066 * k, 0.2, 0.07 + 0.066 * k, 2))
    ragged = [(x, 0.0 if i % 2 else -1e-4) for i, x in enumerate(np.linspace(0, 4, 1200))]
    with pytest.raises(FieldError, match=r"unknowns, at most \d+ are allowed; narrowest is the"):
        HarmonicMap(comb.union(Polygon([*ragged, (4, 0.1), (0, 0.1)])), Point(2, 0.1))
