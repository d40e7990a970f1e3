"""The control loop: from a percept to goals on the bus in every tick."""
