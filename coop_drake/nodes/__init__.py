"""Robots, supervisor and world apart from each other: what each computes, and what crosses between them."""

from coop_drake.lazy import lazy_names

__getattr__, __dir__, __all__ = lazy_names(__name__, __file__)
