"""Dynamixel X servos: Protocol 2.0, from bytes to a bus that recovers by itself."""
