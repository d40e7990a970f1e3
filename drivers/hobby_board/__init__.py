"""Parts shared by boards that send pulses to hobby servos, which have no feedback."""
