"""Common parts of all emulated smart servos."""
