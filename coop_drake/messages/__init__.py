"""Messages between the processes of a team, with sockets, keys and addresses; needs the extra `apart`."""

from coop_drake.lazy import lazy_names

__getattr__, __dir__, __all__ = lazy_names(__name__, __file__)
