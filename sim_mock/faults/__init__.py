"""Faults of emulated lines and servos."""
