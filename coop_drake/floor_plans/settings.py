"""Settings with which a floor plan is read, and the lines for a scenario."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from typing import Annotated, Literal

import yaml
from shapely import Polygon

from coop_drake.errors import FloorPlanError
from coop_drake.geometry.polygons import corners_of
from coop_drake.typed_data import DataError, Limits, check_fields

# Settings for reading a drawing or a map.

Unit = Literal["mm", "cm", "dm", "m", "km", "in", "ft", "yd"]
UNITS: dict[Unit, float] = {
    "mm": 1e-3,
    "cm": 1e-2,
    "dm": 1e-1,
    "m": 1.0,
    "km": 1e3,
    "in": 0.0254,
    "ft": 0.3048,
    "yd": 0.9144,
}
"""Lengths that a file's coordinates may be in [m]."""

Scale = Annotated[float, Limits(at_least=1e-6, at_most=1e6)]
"""Factor on all lengths of a file [-]; no drawing of a floor is further from its true size."""

Tolerance = Annotated[float, Limits(at_least=0.0, at_most=1.0)]
"""Length by which a drawing may be changed [m]; more than a metre would close every door."""


@dataclass(frozen=True)
class FloorPlanSettings:
    """What the file itself does not say, and how accurately it is read.

    Attributes:
        unit: Unit of the file's coordinates, one of ``UNITS``; None for the unit that the file names.
        scale: Factor on all lengths, for example 50 for a drawing at 1:50 [-].
        layers: Names of the layers to read; empty for all visible layers.
        tolerance: Largest growth of walls where corners are removed and curves become chords [m]; None for
            1 cm, or for one and a half cells of a map.
        gap: Lines that end this close to another line are joined to it [m].
        unknown_is_free: Whether the unknown cells of an occupancy map count as floor.
    """

    unit: Unit | None = None
    scale: Scale = 1.0
    layers: tuple[str, ...] = ()
    tolerance: Tolerance | None = None
    gap: Tolerance = 0.01
    unknown_is_free: bool = False

    def check(self, file: str) -> None:
        """Refuse settings that no file can be read with by a FloorPlanError that names the setting."""
        try:
            check_fields(self)
        except DataError as error:
            remedy = f"use {error.allowed.removesuffix(', or null')}"
            raise FloorPlanError(file, error.key, f"{error.value!r} is not allowed", remedy) from error

    @property
    def sagitta(self) -> float:
        """Largest distance of chords from the curves that they replace [m]."""
        return max(0.25 * self.growth(), 1e-4)

    def growth(self, cell: float | None = None) -> float:
        """Largest growth of walls [m]; ``cell`` is the edge of a map's cells [m], None for a drawing."""
        if self.tolerance is not None:
            return self.tolerance
        return 0.01 if cell is None else 1.5 * cell

    def metres(self, unit_of_file: float | None, file: str) -> float:
        """Length of one unit of the file's coordinates in W [m].

        ``unit_of_file`` is the unit that the file names [m], None if it names none.

        Raises:
            FloorPlanError: Neither the file nor the settings name the unit.
        """
        unit = UNITS[self.unit] if self.unit is not None else unit_of_file
        if unit is None:
            raise FloorPlanError(
                file, "unit", "the file does not say what its unit is", f"name it: one of {', '.join(UNITS)}"
            )
        if not 0.0 < unit < inf:
            raise FloorPlanError(file, "unit", f"a unit of {unit:g} m is not allowed", "name the unit")
        return unit * self.scale


# Writes a floor as the section ``workspace`` of a scenario file.

_DECIMALS = 9
"""Decimals of a metre that are written."""


def workspace_section(floor: Polygon, comment: str) -> str:
    """YAML text of a floor's rings, rounded to a nanometre, below a comment of one line."""
    outer, *holes = ((corners.round(_DECIMALS) + 0.0).tolist() for corners in corners_of(floor))
    section = {"workspace": {"outer": outer, **({"holes": holes} if holes else {})}}
    return (
        f"# {' '.join(comment.split())}\n{yaml.safe_dump(section, default_flow_style=None, sort_keys=False)}"
    )
