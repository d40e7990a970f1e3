"""Dynamixel X servos: Protocol 2.0, from bytes to a bus that looks after itself."""
