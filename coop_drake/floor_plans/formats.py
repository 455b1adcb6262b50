"""The floor-plan formats that can be read: to add one, write its reader and enter it in `READERS`.

The formats are also listed for users: in the help of `cli/floor_plan.py`, in `scenario/model.py` (the key
`file`; from it `python -m docs.generate` writes `docs/reference/scenario.md`), in `read_floor_plan` of
`plan.py`, in the README and in `docs/how_to/floor_plan.md`.

A reader takes the path of a file and the settings. It returns a `Drawing` (lines, each of them a wall; see
`walls.py`) or an `OccupancyMap` (cells that are free or not; see `map_file.py`), and raises a
`FloorPlanError` with place, finding and remedy where the file cannot be used. Everything after that, from
gaps to corners, is shared.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

from coop_drake.floor_plans.dxf_file import read_dxf
from coop_drake.floor_plans.map_file import OccupancyMap, read_map
from coop_drake.floor_plans.settings import FloorPlanSettings
from coop_drake.floor_plans.shape_file import read_geojson, read_wkt
from coop_drake.floor_plans.svg_file import read_svg
from coop_drake.floor_plans.walls import Drawing

READERS: Mapping[str, Callable[[Path, FloorPlanSettings], Drawing | OccupancyMap]] = {
    ".svg": read_svg,
    ".dxf": read_dxf,
    ".geojson": read_geojson,
    ".json": read_geojson,
    ".wkt": read_wkt,
    ".yaml": read_map,
    ".yml": read_map,
}
"""The reader of each format, by the suffix of the file's name in lower case."""

SUFFIXES = tuple(READERS)
"""Suffixes of the files that can be read."""
