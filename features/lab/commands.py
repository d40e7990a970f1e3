"""The lab's entries in the list of commands; a light module, because every command imports it."""

from gazerig.robot.cli.command_list import SPECIALIST, CommandEntry

REPORT = CommandEntry(
    "gazerig.features.lab.cli.report",
    "Report how human a run's gaze was: gazerig report run.mcap, then open report.html.",
    "Look back",
    examples=(
        ("report evening.mcap", "how human was the gaze? one HTML file and frames"),
        ("report shy.mcap bold.mcap", "two recordings side by side"),
        ("report --scene face-to-face --seconds 120", "the same of a simulated scene"),
    ),
)
SWEEP = CommandEntry(
    "gazerig.features.lab.cli.sweep",
    "Vary parameters over many simulated runs; write a table of all runs as CSV.",
    SPECIALIST,
    examples=(
        (
            "sweep --set gaze.head.eye_only_range_deg=16:56:7 --seeds 8",
            "a table of 56 runs, made on all processors",
        ),
        (
            "sweep --set gaze.lids.close_ms=50,75 --scheduler tcp://lab1:8786",
            "the same on the machines of a Dask scheduler",
        ),
    ),
)
FIT_SCANPATH = CommandEntry(
    "gazerig.features.lab.cli.fit_scanpath",
    "Fit a walk over the face to an eye-tracker recording; write it as YAML for gazerig run.",
    SPECIALIST,
    examples=(
        ("fit-scanpath gaze.csv --parts boxes.yaml", "a walk from an eye tracker's samples"),
    ),
)
