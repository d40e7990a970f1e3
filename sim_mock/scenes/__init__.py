"""People and things that move."""
