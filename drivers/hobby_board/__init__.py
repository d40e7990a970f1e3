"""Boards that send pulses to hobby servos, which tell nothing: what they share."""
