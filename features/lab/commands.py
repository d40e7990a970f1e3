"""The lab's entries in the list of commands; light, as every command imports them."""

from gazerig.robot.cli.command_list import CommandEntry

REPORT = CommandEntry(
    "gazerig.features.lab.cli.report",
    "Report how human a run's gaze was: gazerig report run.mcap, then open report.html.",
    "Look back",
)
COMPARE = CommandEntry(
    "gazerig.features.lab.cli.report",
    "Show two runs side by side, with the differences that exceed chance.",
    "Look back",
)
SWEEP = CommandEntry(
    "gazerig.features.lab.cli.sweep",
    "Vary parameters over many simulated runs: a table, and a picture of what responds.",
    "Look back",
)
FIT_SCANPATH = CommandEntry(
    "gazerig.features.lab.cli.fit_scanpath",
    "Fit a walk over the face to an eye-tracker recording, as YAML that run takes.",
)
