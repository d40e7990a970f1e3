"""The entries of bring-up in the list of commands; light, as every command imports them."""

from gazerig.robot.cli.command_list import CommandEntry

SCAN = CommandEntry(
    "gazerig.features.bringup.cli.scan",
    "List serial ports, and who answers on one at every baud rate.",
    "Bring-up",
)
SETUP = CommandEntry(
    "gazerig.features.bringup.cli.setup",
    "Set id and baud rate of each servo, one connected at a time; test a Maestro's channels.",
    "Bring-up",
)
DOCTOR = CommandEntry(
    "gazerig.features.bringup.cli.doctor",
    "Examine every port and servo against the rig's YAML; every finding has its cure.",
    "Bring-up",
)
CALIBRATE = CommandEntry(
    "gazerig.features.bringup.cli.calibrate.group",
    "Find out and write into the rig's YAML: joints (the default), camera, face.",
    "Bring-up",
)
JOG = CommandEntry(
    "gazerig.features.bringup.cli.motion",
    "Move one joint slowly while the others hold: gazerig jog my.yaml neck_yaw 20.",
    "Bring-up",
)
HOME = CommandEntry(
    "gazerig.features.bringup.cli.motion",
    "Move slowly to the centre: all joints to 0 deg, lids open; then torque off.",
    "Bring-up",
)
LOOK_AT = CommandEntry(
    "gazerig.features.bringup.cli.motion",
    "Turn eyes and head to a point and tell how well they meet it: X Y Z in metres.",
    "Bring-up",
)
MONITOR = CommandEntry(
    "gazerig.features.bringup.cli.monitor",
    "Watch all servos; reads alone: nothing is written, torque stays as it is.",
    "Bring-up",
)
REBOOT = CommandEntry(
    "gazerig.features.bringup.cli.reboot",
    "Restart servos, which clears latched errors; their torque is off afterwards.",
    "Bring-up",
)
RECORD_GESTURE = CommandEntry(
    "gazerig.features.bringup.cli.record_gesture",
    "Record a gesture by hand: torque off, move the head, and it is written as YAML.",
)
