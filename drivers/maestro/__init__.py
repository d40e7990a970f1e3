"""A Pololu Maestro and the hobby servos behind it, which tell nothing."""
