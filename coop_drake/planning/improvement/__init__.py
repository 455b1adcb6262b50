"""Boxes laid again along the path that was found, so that the transport takes less time."""
