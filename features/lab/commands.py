"""The lab's entries in the list of commands; a light module, because every command imports it."""

from gazerig.robot.cli.command_list import SPECIALIST, CommandEntry

REPORT = CommandEntry(
    "gazerig.features.lab.cli.report",
    "Report how human a run's gaze was: gazerig report run.mcap, then open report.html.",
    "Look back",
    examples={
        "report": (
            ("report evening.mcap", "how human was the gaze? one HTML file and frames"),
            ("report shy.mcap bold.mcap", "two recordings side by side"),
            ("report --scene face-to-face --seconds 120", "the same of a simulated scene"),
        ),
    },
)
SWEEP = CommandEntry(
    "gazerig.features.lab.cli.sweep",
    "Vary parameters over many simulated runs; write a table and a figure of the responses.",
    SPECIALIST,
    examples={
        "sweep": (
            (
                "sweep --set gaze.head.eye_only_range_deg=16:56:7 --seeds 8",
                "a table and curves of 56 runs",
            ),
            (
                "sweep --set gaze.lids.blinks_per_min=8:30:5 --set gaze.lids.close_ms=50,75",
                "a heat map",
            ),
            ("sweep my.yaml --set gaze.head.base_speed_deg_s=40:120 --samples 50", "a sample"),
            ("sweep my.yaml --fit --set gaze.lids.blinks_per_min=4:40", "what is most like people"),
        ),
    },
)
FIT_SCANPATH = CommandEntry(
    "gazerig.features.lab.cli.fit_scanpath",
    "Fit a walk over the face to an eye-tracker recording; write it as YAML for gazerig run.",
    SPECIALIST,
    examples={
        "fit-scanpath": (
            ("fit-scanpath gaze.csv --parts boxes.yaml", "a walk from an eye tracker's samples"),
        ),
    },
)
