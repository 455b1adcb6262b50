"""What the planner is asked and what it answers, and how both are read and written."""

from coop_drake.lazy import lazy_names

__getattr__, __dir__, __all__ = lazy_names(__name__, __file__)
