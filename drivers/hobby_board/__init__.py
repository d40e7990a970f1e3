"""Boards that send pulses to hobby servos, which give no feedback: what they share."""
