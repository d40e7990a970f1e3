"""Device side of a Pololu Maestro, and its hobby servos."""
