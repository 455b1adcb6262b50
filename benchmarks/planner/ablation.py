"""What our planner's own parts are worth: cells alone, and cells split by other rules."""

from __future__ import annotations

from benchmarks.tasks import Task

__all__ = ["ablation_tasks"]


def ablation_tasks(limit: float) -> list[Task]:
    """Stub."""
    return []
