"""The guard between desired joint angles and the bus."""
