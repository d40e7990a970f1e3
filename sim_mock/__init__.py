"""A second world: emulated servos that answer protocol bytes, people who move, a camera."""
