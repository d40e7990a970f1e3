"""What every kind of servo bus shares: models, ports, checks of goals and readings."""
