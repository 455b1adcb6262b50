"""Starts a Meshcat server for this machine, without the line that Drake writes to standard error."""

from __future__ import annotations

import logging

from pydrake.geometry import Meshcat, MeshcatParams


def silent_meshcat(parameters: MeshcatParams | None = None) -> Meshcat:
    """Start a Meshcat server and log no address; ``web_url()`` returns it.

    Args:
        parameters: Its settings; by default only browsers on this machine can open its page.

    Raises:
        RuntimeError: No port is free.
    """
    logger = logging.getLogger("drake")
    logger.addFilter(_is_no_address)
    try:
        return Meshcat(parameters or MeshcatParams(host="localhost"))
    finally:
        logger.removeFilter(_is_no_address)


def _is_no_address(record: logging.LogRecord) -> bool:
    return "Meshcat listening for connections" not in record.getMessage()
