"""The device side of a Pololu Maestro, and the hobby servos behind it."""
