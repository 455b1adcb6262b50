"""Slices of the configuration space, their cells, and the graph in which channels are searched."""
