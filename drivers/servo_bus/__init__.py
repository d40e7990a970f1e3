"""Bus engine shared by all families of smart servos."""
