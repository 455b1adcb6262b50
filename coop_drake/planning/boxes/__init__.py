"""Boxes of configurations that are proved free, laid along a candidate path."""
