"""Properties of servos that no data sheet contains, for the rig's statics and for emulated servos.

All are assumed [A].
"""

GEAR_FRICTION = 0.03
"""Dry friction of motor and gear as a fraction of the stall torque."""
AMBIENT_C = 30.0
"""Temperature of the air in a head."""
STALL_RISE_C = 150.0
"""Final warming of a stalled servo above the air."""
