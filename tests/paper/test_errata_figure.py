"""The picture of errata: every panel shows the printed formula fail where the corrected one holds."""

import numpy as np
import pytest

from coop_drake.drawing.colours import BLUE, VERMILLION
from paper.errata_figure import errata_figure, write_errata_figure


@pytest.fixture(scope="module")
def figure():
    return errata_figure()


@pytest.fixture(scope="module")
def panels(figure):
    return {ax.get_title().split(":")[0]: ax for ax in figure.axes}


def curves(ax, colour):
    return [
        np.asarray(line.get_ydata(), dtype=float)
        for line in ax.get_lines()
        if line.get_color() == colour and len(line.get_ydata()) > 1
    ]


@pytest.mark.parametrize(
    ("panel", "fails"),
    [
        ("E15a", lambda y: y.min() < -2.0),
        ("E15b", lambda y: y.min() > 0.29),
        ("E10", lambda y: y.min() < 2.0),
        ("E21", lambda y: np.abs(y).max() > 1.0),
        ("E17b", lambda y: y.max() > 1e6),
        ("E18", lambda y: y.max() > 1e4),
        ("E20", lambda y: y[-1] > y[0]),
    ],
)
def test_red_fails_and_blue_does_not(panels, panel, fails):
    (red,), (blue,) = curves(panels[panel], VERMILLION), curves(panels[panel], BLUE)
    assert fails(red)
    assert not fails(blue)


def test_the_funnel_has_room_in_blue_only(panels):
    red, blue = curves(panels["E17a"], VERMILLION), curves(panels["E17a"], BLUE)
    assert red[1][0] - red[0][0] == pytest.approx(0.0, abs=1e-12)
    assert blue[1][0] - blue[0][0] > 0.1


def test_the_picture_is_written_where_it_is_said_to_be(figure, tmp_path, monkeypatch):
    monkeypatch.setattr("paper.errata_figure.errata_figure", lambda: figure)
    path = write_errata_figure(tmp_path / "new")
    assert path.parent == tmp_path / "new"
    assert path.stat().st_size > 10_000
