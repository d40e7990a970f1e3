"""The study's entry in the list of commands; light, because every command imports it."""

from gazerig.robot.cli.command_list import CommandEntry

STUDY = CommandEntry(
    "gazerig.features.study.cli",
    "Design, run and analyse a blind study in which people judge two to six styles of gaze.",
    "Study",
    examples=(
        ("study design --example study.yaml", "a study of two gazes to start from"),
        ("study design study.yaml", "check it"),
        ("study design nakamoto_1", "a shipped study: of Nakamoto & Tsuruno"),
        ("study run study.yaml --participant 7", "a session, in the browser"),
        ("study run nakamoto_2 --participant 7 --mock", "on an emulated head"),
        ("study run study.yaml --simulate 24 --data trial", "24 simulated participants"),
        ("study analyse study-data", "one page, and the answers as CSV"),
    ),
)
