"""The search for a channel of free boxes: sampled paths and explorations of cells in turns."""
