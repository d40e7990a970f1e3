"""3-D view: the head, people, the world, and the first viewpoint."""
