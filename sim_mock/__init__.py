"""Simulated hardware and surroundings: servos that answer protocol bytes, people, cameras."""
