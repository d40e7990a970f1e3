"""The commands of ``gazerig``: where each is defined, and its line in the list of all.

The list is written here and not collected, as a short command must not wait for the modules of all
others; tests/test_cli_start.py holds it against them.
"""

from typing import NamedTuple


class CommandEntry(NamedTuple):
    """One command in the list.

    module: of this folder, which has it in its ``app``; summary: the first paragraph of its help
    """

    module: str
    summary: str


PANELS: dict[str, dict[str, CommandEntry]] = {
    "Run": {
        "run": CommandEntry(
            "run", "Run the head: gazerig run --mock, then open the page it names."
        ),
        "ctl": CommandEntry(
            "tune",
            "Speak to a rig that runs in another terminal: parameters, where it looks, "
            "what it does.",
        ),
        "stop": CommandEntry(
            "tune",
            "Torque off at once, of every rig that runs here; nothing parks, the programs go on.",
        ),
    },
    "Look back": {
        "replay": CommandEntry(
            "replay",
            "Show a recorded run on the page, with a time slider; or run it again with --rerun.",
        ),
        "report": CommandEntry(
            "report",
            "Report how human a run's gaze was: gazerig report run.mcap, then open report.html.",
        ),
        "compare": CommandEntry(
            "report", "Show two runs side by side, with the differences that exceed chance."
        ),
        "sweep": CommandEntry(
            "sweep",
            "Vary parameters over many simulated runs: a table, and a picture of what responds.",
        ),
        "export": CommandEntry(
            "replay",
            "Write a recorded run as eye-tracking tools read it: degrees, + left and + up.",
        ),
    },
    "Study": {
        "study": CommandEntry(
            "study", "Let people judge two to six gazes, blind: design, run and analyse a study."
        ),
    },
    "Bring-up": {
        "scan": CommandEntry(
            "scan", "List serial ports, and who answers on one at every baud rate."
        ),
        "setup": CommandEntry(
            "setup",
            "Set id and baud rate of each servo, one connected at a time; test a Maestro's "
            "channels.",
        ),
        "doctor": CommandEntry(
            "doctor",
            "Examine every port and servo against the rig's YAML; every finding has its cure.",
        ),
        "calibrate": CommandEntry(
            "calibrate.group",
            "Find out and write into the rig's YAML: joints (the default), camera, face.",
        ),
        "jog": CommandEntry(
            "motion",
            "Move one joint slowly while the others hold: gazerig jog my.yaml neck_yaw 20.",
        ),
        "home": CommandEntry(
            "motion", "Move slowly to the centre: all joints to 0 deg, lids open; then torque off."
        ),
        "look-at": CommandEntry(
            "motion",
            "Turn eyes and head to a point and tell how well they meet it: X Y Z in metres.",
        ),
        "monitor": CommandEntry(
            "monitor",
            "Watch all servos; reads alone: nothing is written, torque stays as it is.",
        ),
        "reboot": CommandEntry(
            "reboot",
            "Restart servos, which clears latched errors; their torque is off afterwards.",
        ),
    },
    "Tools": {
        "new": CommandEntry(
            "new",
            "Write a rig's YAML of your own from a few answers, check it, and say what to type "
            "next.",
        ),
        "check": CommandEntry(
            "rig_check",
            "Check a rig's YAML and nothing else: all faults at once, no servo is touched.",
        ),
        "describe": CommandEntry(
            "describe",
            "Write a rig as a robot description: MJCF, URDF and glTF with meshes, or one of them.",
        ),
        "kinds": CommandEntry(
            "kinds",
            "List buses, cameras, detectors, rules, gestures and rigs, of this program and of "
            "packages.",
        ),
        "schema": CommandEntry(
            "rig_check",
            "Export the JSON Schema of rig files, for editors; also of studies and questionnaires.",
        ),
        "models": CommandEntry(
            "models",
            "List and fetch model files, with which the camera finds more: faces, people, hands, eyes.",
        ),
        "emulate": CommandEntry(
            "emulate",
            "Emulate servos on a pseudo-terminal; prints its path as JSON, takes fault commands.",
        ),
        "record-camera": CommandEntry(
            "record", "Record what a camera gives, for gazerig run --camera-recording FILE."
        ),
        "record-gesture": CommandEntry(
            "gestures",
            "Record a gesture by hand: torque off, move the head, and it is written as YAML.",
        ),
        "import-gesture": CommandEntry(
            "gestures",
            "Make a gesture of key frames from an animation program, as YAML that rigs take.",
        ),
        "fit-scanpath": CommandEntry(
            "fit_scanpath",
            "Fit a walk over the face to an eye-tracker recording, as YAML that run takes.",
        ),
    },
}
"""Panel of the help -> its commands, all in the order in which they are shown."""

COMMANDS = {name: entry for panel in PANELS.values() for name, entry in panel.items()}
