"""Where the team may not go looks like wall."""

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from shapely import Polygon

from coop_drake.drawing.canvas import draw_workspace

PILLAR = [(1, 1), (3, 1), (3, 3), (1, 3)]


@pytest.mark.parametrize("ring", [PILLAR, PILLAR[::-1]], ids=["counter-clockwise", "clockwise"])
def test_a_pillar_has_the_colour_of_the_walls_whichever_way_its_ring_goes(ring):
    canvas = FigureCanvasAgg(Figure())
    ax = canvas.figure.subplots()
    draw_workspace(ax, Polygon([(0, 0), (4, 0), (4, 4), (0, 4)], [ring]))
    canvas.draw()
    picture = np.asarray(canvas.buffer_rgba())

    def colour(x, y):
        column, row = ax.transData.transform((x, y))
        return picture[len(picture) - int(row), int(column)].tolist()

    assert colour(2.0, 2.1) == colour(-0.15, 2.1) != colour(0.5, 2.1)
