"""Shapes of the floor and of the team: the component tree, its conservative sweeps, free space, tidy cells."""
