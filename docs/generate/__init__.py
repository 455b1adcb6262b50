"""Builds the documentation from pages that are written by hand and pages that are made from the code."""
