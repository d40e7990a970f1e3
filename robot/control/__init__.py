"""The control loop: one tick after the other, from a percept to goals on the bus."""
