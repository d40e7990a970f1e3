"""A Pololu Maestro and its hobby servos, which have no feedback."""
