"""Harmonic maps of planar cells to the unit disk, and the velocity fields they induce."""
