"""Peak memory of this process and of its children."""

from __future__ import annotations

import resource
import sys
from pathlib import Path

_STATUS = Path("/proc/self/status")
_UNIT = 1e-6 if sys.platform == "darwin" else 1.024e-3
"""Unit of ``ru_maxrss`` [MB]: macOS counts bytes, Linux kibibytes."""


def peak_memory_mb() -> float:
    """Return the largest resident memory so far of this process or of a child that has ended [MB].

    On Linux it is read from ``/proc``: the figure of ``getrusage`` includes the memory that the parent had
    when it started this process.
    """
    children = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss * _UNIT
    if _STATUS.exists():
        fields = dict(line.split(":", 1) for line in _STATUS.read_text().splitlines())
        if "VmHWM" in fields:
            return max(children, int(fields["VmHWM"].split()[0]) * _UNIT)
    return max(children, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * _UNIT)
