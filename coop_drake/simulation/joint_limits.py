"""Keeps Drake from warning about joint limits that the funnels keep."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import contextmanager

__all__ = ["joint_limits_kept_by_funnels"]


@contextmanager
def joint_limits_kept_by_funnels() -> Iterator[None]:
    """Let Drake warn of everything but this: in continuous time it does not simulate joint limits.

    Slices end at the limits and funnels inside slices, which every accepted step is checked for.
    """
    logger = logging.getLogger("drake")
    logger.addFilter(_matters)
    try:
        yield
    finally:
        logger.removeFilter(_matters)


def _matters(record: logging.LogRecord) -> bool:
    return "does not handle joint limits for continuous models" not in record.getMessage()
