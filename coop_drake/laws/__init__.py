"""The control laws, each written once as a small compiled function: numbers in, numbers out."""

from coop_drake.lazy import lazy_names

__getattr__, __dir__, __all__ = lazy_names(__name__, __file__)
