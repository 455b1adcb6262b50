"""Random planning questions, how their answers are judged, and other planners that try to refute them."""
