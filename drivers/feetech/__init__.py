"""Feetech STS servos: packets, registers, and a bus with the same promises."""
