"""Addresses of an emulated Dynamixel servo's registers with live values."""

import struct

SENSED, SENSED_AT = struct.Struct("<hii"), 126
"""Current, velocity, position: a control loop reads them every tick."""
SURROUNDINGS, SURROUNDINGS_AT = struct.Struct("<HB"), 144
"""Voltage and temperature."""
MOTION, MOTION_AT = struct.Struct("<HBBh"), 120
"""Tick, moving, moving status, PWM."""
REFERENCE, REFERENCE_AT = struct.Struct("<ii"), 136
"""Velocity and position of the profile."""

SENSED_SPAN = SENSED_AT, REFERENCE_AT
SURROUNDINGS_SPAN = SURROUNDINGS_AT, SURROUNDINGS_AT + SURROUNDINGS.size
PROFILED = ((MOTION_AT, SENSED_AT), (REFERENCE_AT, SURROUNDINGS_AT))
"""Their addresses; the last two are the profile's, which a control loop rarely reads."""
