"""Addresses of an emulated Dynamixel servo's registers that change by themselves."""

import struct

SENSED, SENSED_AT = struct.Struct("<hii"), 126
"""Current, velocity, position: what a control loop reads every tick."""
SURROUNDINGS, SURROUNDINGS_AT = struct.Struct("<HB"), 144
"""Voltage and temperature."""
MOTION, MOTION_AT = struct.Struct("<HBBh"), 120
"""Tick, moving, moving status, PWM."""
REFERENCE, REFERENCE_AT = struct.Struct("<ii"), 136
"""Velocity and position that the profile asks for."""

SENSED_SPAN = SENSED_AT, REFERENCE_AT
SURROUNDINGS_SPAN = SURROUNDINGS_AT, SURROUNDINGS_AT + SURROUNDINGS.size
PROFILED = ((MOTION_AT, SENSED_AT), (REFERENCE_AT, SURROUNDINGS_AT))
"""Their addresses; the last two are the profile's, which a control loop rarely reads."""
