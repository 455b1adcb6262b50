"""Thin LeafSystems over the control laws, the velocity fields and the cell planner."""
