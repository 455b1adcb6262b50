"""Suppresses Drake's warning about joint limits, which the funnels keep."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def joint_limits_kept_by_funnels() -> Iterator[None]:
    """Suppress Drake's warning that it does not simulate joint limits in continuous time, and no other.

    Slices lie within the joint limits and funnels within slices; the invariants check this at every step.
    """
    logger = logging.getLogger("drake")
    logger.addFilter(_matters)
    try:
        yield
    finally:
        logger.removeFilter(_matters)


def _matters(record: logging.LogRecord) -> bool:
    return "does not handle joint limits for continuous models" not in record.getMessage()
