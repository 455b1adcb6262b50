from .axis_departure import AxisLoop, axis_loop
from .couplings import TeamCouplings, team_couplings
from .nominal_axes import AxisSets, axis_sets
from .position import PositionGains, position_bounds

__all__ = [
    "AxisLoop",
    "AxisSets",
    "PositionGains",
    "TeamCouplings",
    "axis_loop",
    "axis_sets",
    "position_bounds",
    "team_couplings",
]
