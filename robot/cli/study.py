"""The commands under study: from a design to its analysis."""

import typer

from gazerig.robot.cli.study_analyse import analyse
from gazerig.robot.cli.study_design import design

app = typer.Typer(
    name="study",
    help="Let people judge two to six gazes, blind: design, run and analyse a study.",
    no_args_is_help=True,
)
app.command("design")(design)
app.command("analyse")(analyse)
