"""Departures of usual teams, named by presets: plain data, as a scenario file would hold them."""

from typing import Any, Literal

from coop_drake.typed_data import below, convert

Preset = Literal["mobile_base"]
"""The name of a usual team's departures."""

PRESETS: dict[Preset, dict[str, Any]] = {
    "mobile_base": {
        "control_rate": 200.0,
        "mass_error": 0.2,
        "measurements": {"position_noise": 0.001, "angle_noise": 0.0005, "rate_noise": 0.01, "delay": 0.01},
        "actuators": {"base_force": 650.0, "lag": 0.005},
        "messages": {"loss": 0.2},
    }
}
"""What each preset says, in the units of ``deployment``. Mobile base: a robot that computes on board, and
measures poses by laser or camera."""


def with_preset(data: dict[str, Any], key: str) -> dict[str, Any]:
    """Return the data of a file with the departures of its preset in place of the preset's name.

    Keys beside the preset replace its own.

    Args:
        data: A mapping that may have the key ``preset``.
        key: Where it stands in the file.

    Raises:
        DataError: There is no such preset.
    """
    own = {name: value for name, value in data.items() if name != "preset"}
    preset = convert(data.get("preset"), Preset | None, below(key, "preset"))
    return own if preset is None else _replaced(PRESETS[preset], own)


def _replaced(data: dict[str, Any], changes: dict[str, Any]) -> dict[str, Any]:
    """Return nested mappings with other entries; an entry that is no mapping replaces what stood there."""
    nested = {
        name: _replaced(data[name], entry)
        for name, entry in changes.items()
        if isinstance(entry, dict) and isinstance(data.get(name), dict)
    }
    return {**data, **changes, **nested}
