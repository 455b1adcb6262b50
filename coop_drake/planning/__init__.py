"""From a problem to a plan: slices, cells, the cell graph, and the transitions that the controllers follow."""
