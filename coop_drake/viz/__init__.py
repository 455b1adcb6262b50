"""Figures of the paper and Meshcat recordings of a run."""
