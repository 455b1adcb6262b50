"""Searches for departures with which runs are lost: the worst within bounds, and how far beyond them."""
