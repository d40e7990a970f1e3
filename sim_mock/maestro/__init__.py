"""Device side of a Pololu Maestro."""
