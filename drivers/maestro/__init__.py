"""A Pololu Maestro and the hobby servos behind it, which give no feedback."""
