"""Notebooks, committed without output; ``python -m notebooks DIR`` executes them all."""
