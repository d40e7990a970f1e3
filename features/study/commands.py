"""The study's entry in the list of commands; light, as every command imports it."""

from gazerig.robot.cli.command_list import CommandEntry

STUDY = CommandEntry(
    "gazerig.features.study.cli.group",
    "Let people judge two to six gazes, blind: design, run and analyse a study.",
    "Study",
)
