"""Starts Meshcat without Drake's own line on standard error: who wants its address told tells it."""

from __future__ import annotations

import logging

from pydrake.geometry import Meshcat, MeshcatParams

__all__ = ["silent_meshcat"]


def silent_meshcat(parameters: MeshcatParams | None = None) -> Meshcat:
    """Start a Meshcat server that does not announce itself; ``web_url()`` is its address.

    Args:
        parameters: As Drake's; its defaults if None.

    Raises:
        RuntimeError: No port is free.
    """
    logger = logging.getLogger("drake")
    logger.addFilter(_matters)
    try:
        return Meshcat(parameters or MeshcatParams())
    finally:
        logger.removeFilter(_matters)


def _matters(record: logging.LogRecord) -> bool:
    return "Meshcat listening for connections" not in record.getMessage()
