"""The guard between what is desired and the bus."""
