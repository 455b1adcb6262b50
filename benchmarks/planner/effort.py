"""Estimated transports over planning time: ``python -m benchmarks.planner.effort FILE`` draws them."""

from __future__ import annotations

import sys
from math import log10
from pathlib import Path

from benchmarks.planner.cases import Case
from coop_drake.answers import Found
from coop_drake.laws import ScheduledGains
from coop_drake.planning.planner import plan

__all__ = ["drawn", "quickest_by_time"]

CASES = {
    "base": "#0072b2",
    "tight": "#d55e00",
    "three": "#009e73",
    "elbow": "#cc79a7",
    "warehouse": "#e69f00",
}
"""Shipped scenarios that have a plan, and the colours of their lines."""

EFFORTS = (0.0, 0.5, 16.0)
"""Each is asked for once; the last one also gives what every smaller one from 1 on gives."""

_LEFT, _TOP, _WIDTH, _HEIGHT = 50, 12, 330, 150
"""Place of the axes in the picture [px]."""

_SECONDS, _EXCESS = (0.2, 10.0), 0.6
"""Range of planning times [s], and the largest part of the best estimate that is drawn on top of it [-]."""


def quickest_by_time(name: str) -> list[tuple[float, float]]:
    """Planning times and the estimated transports that are known by then, in their order [CPU s, s]."""
    problem = Case(name).problem()
    points: list[tuple[float, float]] = []
    plan(problem, ScheduledGains(), gain_set_name="scheduled")  # loads the kernels
    for effort in EFFORTS:
        result = plan(problem, ScheduledGains(), gain_set_name="scheduled", effort=effort)
        assert isinstance(result, Found)
        points += result.report.improvements
    best: list[tuple[float, float]] = []
    for seconds, estimate in sorted(points):
        if not best or estimate < best[-1][1]:
            best.append((seconds, estimate))
    return best


def drawn(lines: dict[str, list[tuple[float, float]]]) -> str:
    """Draw estimates over their best one, over planning time, as SVG for a page of the documentation."""
    right, bottom = _LEFT + _WIDTH, _TOP + _HEIGHT

    def x(seconds: float) -> int:
        span = log10(_SECONDS[1] / _SECONDS[0])
        return round(_LEFT + _WIDTH * min(1.0, max(0.0, log10(seconds / _SECONDS[0]) / span)))

    def y(excess: float) -> int:
        return round(bottom - _HEIGHT * min(1.0, excess / _EXCESS))

    ticks, levels = (0.2, 0.5, 1, 2, 5, 10), (0.0, 0.2, 0.4, 0.6)
    parts = [
        '<svg viewBox="0 0 480 200" width="480" role="img" aria-label="Estimate over planning time" '
        'font-size="11" fill="currentColor" stroke="none">',
        '<g stroke="currentColor" stroke-opacity="0.2">'
        + f'<path d="{"".join(f"M{_LEFT} {y(level)}H{right}" for level in levels)}'
        + f'{"".join(f"M{x(tick)} {_TOP}V{bottom}" for tick in ticks)}"/></g>',
        '<g text-anchor="end">'
        + "".join(f'<text x="{_LEFT - 6}" y="{y(level) + 4}">{100 * level:+.0f} %</text>' for level in levels)
        + "</g>",
        '<g text-anchor="middle">'
        + "".join(f'<text x="{x(tick)}" y="{bottom + 16}">{tick:g} s</text>' for tick in ticks)
        + f'<text x="{(_LEFT + right) // 2}" y="{bottom + 32}">planning time</text></g>',
    ]
    for number, (name, points) in enumerate(lines.items()):
        best = points[-1][1]
        path = f"M{x(points[0][0])} {y(points[0][1] / best - 1.0)}"
        path += "".join(f"H{x(seconds)}V{y(estimate / best - 1.0)}" for seconds, estimate in points[1:])
        parts.append(f'<path d="{path}H{right}" fill="none" stroke="{CASES[name]}" stroke-width="2"/>')
        label = f"{name}, {best:.1f} s"
        parts.append(
            f'<text x="{right + 8}" y="{_TOP + 20 + 16 * number}" fill="{CASES[name]}">{label}</text>'
        )
    return "\n".join(("\n  ".join(parts), "</svg>")) + "\n"


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(drawn({name: quickest_by_time(name) for name in CASES}), encoding="utf-8")
