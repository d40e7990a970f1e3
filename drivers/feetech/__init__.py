"""Feetech STS servos: packets, registers, and their bus."""
