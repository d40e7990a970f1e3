"""The commands under study: from a design to its analysis."""

import typer

from gazerig.robot.cli.study_analyse import analyse
from gazerig.robot.cli.study_design import design
from gazerig.robot.cli.study_run import delete, film, run

app = typer.Typer(
    name="study",
    help="Let people judge two to six gazes, blind: design, run and analyse a study.",
    no_args_is_help=True,
)
app.command("design")(design)
app.command("film")(film)
app.command("run")(run)
app.command("delete")(delete)
app.command("analyse")(analyse)
