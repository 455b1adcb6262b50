"""Panels of the errata's figure that show one angle in its funnel, that of the first cell of Table 1."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from scipy.integrate import solve_ivp

from coop_drake.drawing.colours import BLUE, GREY, VERMILLION
from coop_drake.laws import Funnel, funnel_bounds
from coop_drake.tree.arrays import FloatArray
from paper import printed
from paper.table_1 import CORRECTED, START

__all__ = ["draw_funnel_bounds", "draw_hand_over_acceleration", "draw_log_decay", "draw_log_term"]

_LOWER, _UPPER = float(CORRECTED[0, 0]), float(CORRECTED[0, 1])
_GOAL_LOWER, _GOAL_UPPER = float(CORRECTED[1, 0]), _UPPER
_DECAY = 2.0
_TIMES = np.linspace(0.0, 3.0, 121)


def _bounds(time: float, goal: tuple[float, float] = (_GOAL_LOWER, _GOAL_UPPER)) -> list[float]:
    """Return the lower and the upper bound of (17) corrected, with their rates and accelerations."""
    lower, upper, goal_lower, goal_upper, decay = np.array(
        [[_LOWER], [_UPPER], [goal[0]], [goal[1]], [_DECAY]]
    )
    funnel = Funnel(lower, upper, goal_lower, goal_upper, decay, shape="exponential")
    return [float(wall[0]) for wall in funnel_bounds(funnel, time)]


def draw_funnel_bounds(ax: Axes) -> None:
    """E17a: as printed, both bounds of (17) start at theta_l, and the start lies outside."""
    names = {
        "theta_l": _LOWER,
        "theta_u": _UPPER,
        "goal_l": _GOAL_LOWER,
        "goal_u": _GOAL_UPPER,
        "decay_rate": _DECAY,
    }
    wrong = np.array([printed.angle_bounds(t, **names) for t in _TIMES])
    right = np.array([_bounds(t)[:2] for t in _TIMES])
    for bounds, colour in ((wrong, VERMILLION), (right, BLUE)):
        ax.plot(_TIMES, bounds, color=colour)
        ax.fill_between(_TIMES, bounds[:, 0], bounds[:, 1], color=colour, alpha=0.12, linewidth=0)
    ax.plot(0.0, START[0], "o", color=GREY, markersize=5, label="start")
    ax.set(title="E17a: the start lies outside", xlabel="time [s]", ylabel="angle [rad]")
    ax.legend(loc="lower right")


def draw_hand_over_acceleration(ax: Axes, erosion: float) -> None:
    """E17b: (18) on entry into a cell; it has no bound at the end of the slice, where the last goal ends."""
    distances = np.geomspace(1e-6, 0.1, 60)
    begin = _bounds(0.0)
    pull = np.array([abs(printed.axis_law(_LOWER + d, 0.0, begin)[0]) for d in distances])
    allowed = distances >= erosion * (_GOAL_UPPER - _GOAL_LOWER)
    ax.loglog(distances, pull, color=VERMILLION)
    ax.loglog(distances[allowed], pull[allowed], color=BLUE, linewidth=2.5)
    ax.set(
        title="E17b: unbounded on entry",
        xlabel="distance to the slice's end [rad]",
        ylabel="acceleration [rad/s²]",
    )


def draw_log_term(ax: Axes) -> None:
    """E18: the logarithm a quarter into the funnel, towards a point without gain and towards an interval."""
    for half_width, log_gain, colour in ((0.0, 1.0, VERMILLION), (0.02, 0.1, BLUE)):
        goal = (1.7 - half_width, 1.7 + half_width)
        pulls = []
        for time in 2.0 * _TIMES:
            bounds = _bounds(time, goal)
            x = 0.75 * bounds[0] + 0.25 * bounds[1]
            terms = [printed.axis_law(x, 0.0, bounds, log_gain=gain)[0] for gain in (log_gain, 0.0)]
            pulls.append(abs(terms[0] - terms[1]))
        ax.semilogy(2.0 * _TIMES, pulls, color=colour)
    ax.set(title="E18: grows without bound", xlabel="time [s]", ylabel="log term [rad/s²]")


def draw_log_decay(ax: Axes) -> None:
    """E20: s along x' = v decays like exp(-k1 t) only if v contains the rates of both bounds."""
    for missing_dot, colour in ((True, VERMILLION), (False, BLUE)):

        def rate(time: float, x: FloatArray, missing_dot: bool = missing_dot) -> list[float]:
            bounds = _bounds(time)
            return [printed.axis_law(x[0], 0.0, bounds, first_rate=bounds[0] if missing_dot else None)[1]]

        start = [0.3 * _LOWER + 0.7 * _UPPER]
        run = solve_ivp(rate, (0.0, _TIMES[-1]), start, t_eval=_TIMES, rtol=1e-9, atol=1e-12)
        bounds = np.array([_bounds(t)[:2] for t in run.t])
        with np.errstate(invalid="ignore"):
            s = np.log((run.y[0] - bounds[:, 0]) / (bounds[:, 1] - run.y[0]))
        ax.plot(run.t, s, color=colour)
    ax.set(title="E20: it drifts to the bound", xlabel="time [s]", ylabel="s, 0 in the middle")
