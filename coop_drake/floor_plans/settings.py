"""Settings for reading a drawing or a map."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, isfinite

from coop_drake.errors import FloorPlanError

__all__ = ["UNITS", "FloorPlanSettings"]

UNITS = {"mm": 1e-3, "cm": 1e-2, "dm": 1e-1, "m": 1.0, "km": 1e3, "in": 0.0254, "ft": 0.3048, "yd": 0.9144}
"""Lengths that a file's coordinates may be in [m]."""


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

    unit: str | None = None
    scale: float = 1.0
    layers: tuple[str, ...] = ()
    tolerance: float | None = None
    gap: float = 0.01
    unknown_is_free: bool = False

    def check(self, file: str) -> None:
        """Refuse settings that no file can be read with.

        Raises:
            FloorPlanError: Naming the setting.
        """
        if self.unit is not None and self.unit not in UNITS:
            raise FloorPlanError(file, "unit", f"{self.unit!r} is no unit", f"use one of {', '.join(UNITS)}")
        for name, value, least, most in (
            ("scale", self.scale, 1e-6, 1e6),
            ("tolerance", self.tolerance, 0.0, 1.0),
            ("gap", self.gap, 0.0, 1.0),
        ):
            if value is not None and not (isfinite(value) and least <= value <= most):
                allowed = f"a number between {least:g} and {most:g}"
                raise FloorPlanError(file, name, f"{value!r} is out of range", f"use {allowed}")

    @property
    def sagitta(self) -> float:
        """Largest distance of chords from the curves that they replace [m]."""
        return max(0.25 * self.growth(), 1e-4)

    def growth(self, cell: float | None = None) -> float:
        """Largest growth of walls [m].

        Args:
            cell: Edge of a map's cells [m], None for a drawing.
        """
        if self.tolerance is not None:
            return self.tolerance
        return 0.01 if cell is None else 1.5 * cell

    def metres(self, unit_of_file: float | None, file: str) -> float:
        """Length of one unit of the file's coordinates in W [m].

        Args:
            unit_of_file: The unit that the file names [m], None if it names none.
            file: For messages.

        Raises:
            FloorPlanError: Neither the file nor the settings name the unit.
        """
        unit = UNITS[self.unit] if self.unit is not None else unit_of_file
        if unit is None:
            raise FloorPlanError(
                file, "unit", "the file does not say what its unit is", f"say it: one of {', '.join(UNITS)}"
            )
        if not 0.0 < unit < inf:
            raise FloorPlanError(file, "unit", f"a unit of {unit:g} m cannot be meant", "name the unit")
        return unit * self.scale
