"""Figures are written whole, and the same figure gives the same bytes."""

import pytest

from coop_drake.drawing.canvas import new_figure, save_figure


@pytest.mark.parametrize(("suffix", "begins"), [(".png", b"\x89PNG"), (".svg", b"<?xml")])
def test_the_same_figure_gives_the_same_bytes_of_the_kind_that_the_name_asks_for(tmp_path, suffix, begins):
    written = []
    for name in ("a", "b"):
        figure = new_figure(3.0, 2.0, "A caption.")
        figure.subplots().plot([0.0, 1.0], [0.0, 1.0])
        save_figure(figure, tmp_path / (name + suffix))
        written.append((tmp_path / (name + suffix)).read_bytes())
    assert written[0] == written[1]
    assert written[0].startswith(begins)
