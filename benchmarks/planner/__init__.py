"""The planner compared with other planners, without its own parts and stages, and on growing questions."""
