"""The guard between wish and bus."""
