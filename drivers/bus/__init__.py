"""Parts shared by all kinds of servo buses: models, ports, checks of goals and readings."""
