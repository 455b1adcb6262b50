"""The compressed corner beside a finely graded one."""

import numpy as np
import pytest

from coop_drake.harmonic_maps.panels import corner_operator, leg_panels, panel_nodes


def wedge_kernel(angle, target, source, weight):
    s, t = target[:, None], source[None, :]
    return s * np.sin(angle) / np.pi / (s * s + t * t - 2 * np.cos(angle) * s * t) * weight


def graded_breaks(levels, parts):
    rings = [2.0**-k * (0.5 + 0.5 * np.arange(parts + 1) / parts) for k in range(levels, -1, -1)]
    return np.concatenate([[0.0], *[ring[:-1] for ring in rings], [1.0]])


@pytest.mark.parametrize("degrees", [20.0, 75.0, 135.0, 200.0, 315.0, 345.0])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_compressed_corner_acts_like_a_finely_graded_one(degrees, sign):
    angle = np.deg2rad(degrees)
    gap = min(angle, 2 * np.pi - angle)
    x, w = panel_nodes(graded_breaks(64, int(np.ceil(1.0 / np.sin(min(gap, np.pi / 2))))), 8)
    incoming = np.cos
    density = np.linalg.solve(np.eye(len(x)) + sign * wedge_kernel(angle, x, x, w), incoming(x))
    seen_from_afar = np.sum(w * density / (x + 1.5))

    operator = corner_operator(angle, 12, 1.5)
    x_leg, w_leg = panel_nodes(leg_panels(angle, 1.5)[0], 12)
    compressed = operator.compressed[0 if sign > 0 else 1] @ incoming(x_leg)
    assert np.sum(w_leg * compressed / (x_leg + 1.5)) == pytest.approx(seen_from_afar, abs=2e-9)


@pytest.mark.parametrize("degrees", [12.0, 90.0, 270.0])
def test_ring_and_the_scale_below_make_up_the_whole_corner(degrees):
    angle = np.deg2rad(degrees)
    operator = corner_operator(angle, 16, 1.5)
    grid, ring = leg_panels(angle, 1.5)
    _, w = panel_nodes(grid, 16)
    _, w_ring = panel_nodes(ring, 16)
    for parity in (0, 1):
        whole = w @ operator.compressed[parity]
        below = 0.5 * w @ operator.compressed[parity] @ operator.inward[parity]
        np.testing.assert_allclose(w_ring @ operator.ring[parity] + below, whole, atol=1e-11)


def test_straight_corner_changes_nothing():
    operator = corner_operator(np.pi, 10, 1.5)
    np.testing.assert_allclose(operator.compressed, np.broadcast_to(np.eye(10), (2, 10, 10)), atol=1e-12)


def test_sharp_corners_have_finer_rings():
    assert len(leg_panels(np.pi / 2, 1.5)[1]) == 2
    assert len(leg_panels(np.deg2rad(5), 1.5)[1]) > len(leg_panels(np.deg2rad(20), 1.5)[1]) > 2
    np.testing.assert_allclose(leg_panels(np.deg2rad(350), 1.5)[1], leg_panels(np.deg2rad(10), 1.5)[1])
