"""A world with physics: a room with people, the rig in it, and what its camera sees."""
