"""Changes to a deck: only the lines that hold what changed."""
