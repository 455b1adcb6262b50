"""Two galleries for the documentation: six floors with one team, and six teams on one kind of floor."""
