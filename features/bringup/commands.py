"""The entries of bring-up in the list of commands; light, because every command imports them."""

from gazerig.robot.cli.command_list import CommandEntry

SCAN = CommandEntry(
    "gazerig.features.bringup.cli.scan",
    "List serial ports, and the servos that answer on one at any baud rate.",
    "Bring-up",
    examples=(
        ("scan", "ports, and the servos on the only one"),
        (
            "scan --port /dev/ttyUSB0",
            "who answers on this port, of any kind, at every baud rate",
        ),
    ),
)
SETUP = CommandEntry(
    "gazerig.features.bringup.cli.setup",
    "Set id and baud rate of the servos, connected one at a time, or of a spare in its chain.",
    "Bring-up",
    examples=(
        ("setup my.yaml", "give new servos their ids, one at a time"),
        ("setup my.yaml --joint neck_yaw", "one servo only"),
    ),
)
DOCTOR = CommandEntry(
    "gazerig.features.bringup.cli.doctor",
    "Check every port and servo against the rig's YAML; every finding comes with a remedy.",
    "Bring-up",
    examples=(
        ("doctor my.yaml", "port, servos and settings against the file, with cures"),
        ("doctor my.yaml --fix", "mend what is safe to mend; nothing moves"),
        ("doctor my.yaml --mock", "see what it looks like without hardware"),
    ),
)
CALIBRATE = CommandEntry(
    "gazerig.features.bringup.cli.calibrate.group",
    "Calibrate joints (the default), camera or face, and write the result into the rig's YAML.",
    "Bring-up",
    examples=(
        ("calibrate joints my.yaml", "find zeros and ends of all joints"),
        ("calibrate board board.pdf", "print the board for the next one"),
        ("calibrate camera my.yaml", "the lens, and where the camera sits"),
        ("calibrate face my.yaml --oak", "steer the gaze onto your own eyes and mouth"),
    ),
)
JOG = CommandEntry(
    "gazerig.features.bringup.cli.motion",
    "Move one joint slowly while the others hold: gazerig jog my.yaml neck_yaw 20.",
    "Bring-up",
    examples=(("jog my.yaml neck_yaw 20", "turn the neck 20 deg to the left, slowly"),),
)
MONITOR = CommandEntry(
    "gazerig.features.bringup.cli.monitor",
    "Show the readings of all servos; nothing is written to them, the torque stays as it is.",
    "Bring-up",
    examples=(("monitor my.yaml", "watch temperatures, loads and positions"),),
)
RECORD_TRACK = CommandEntry(
    "gazerig.features.bringup.cli.record_track",
    "Record a track in YAML: by hand with torque off, or with --live of a running head.",
    examples=(
        ("record-track my.yaml greeting", "torque off; move the head by hand, Enter ends it"),
        (
            "record-track my.yaml mouth --live --joint jaw",
            "of a running head: your jaw to a track of the neck that plays",
        ),
    ),
)
