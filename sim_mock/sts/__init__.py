"""The device side of Feetech STS servos: bytes in, bytes out."""
