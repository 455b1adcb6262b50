from .canvas import house_style, legend_above, new_figure, save_figure
from .floor import BodyFootprint, draw_polygon, draw_team, draw_workspace, team_footprints, team_legend
from .solids import (
    TriangleMesh,
    camera_pose,
    extruded_section,
    flat_mesh,
    joined,
    ribbon_mesh,
    ring_lines,
    slab_mesh,
    tube_mesh,
    wall_polygons,
)

__all__ = [
    "BodyFootprint",
    "TriangleMesh",
    "camera_pose",
    "draw_polygon",
    "draw_team",
    "draw_workspace",
    "extruded_section",
    "flat_mesh",
    "house_style",
    "joined",
    "legend_above",
    "new_figure",
    "ribbon_mesh",
    "ring_lines",
    "save_figure",
    "slab_mesh",
    "team_footprints",
    "team_legend",
    "tube_mesh",
    "wall_polygons",
]
