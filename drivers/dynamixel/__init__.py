"""Dynamixel X servos (Protocol 2.0): packets, control tables and their bus."""
