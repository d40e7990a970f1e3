"""The commands under study: from a design to its analysis."""

import typer

from gazerig.features.study.cli.analyse import analyse
from gazerig.features.study.cli.design import design
from gazerig.features.study.cli.run import delete, film, run

app = typer.Typer(
    name="study",
    help="Design, run and analyse a blind study in which people judge two to six styles of gaze.",
    no_args_is_help=True,
)
app.command("design")(design)
app.command("film")(film)
app.command("run")(run)
app.command("delete")(delete)
app.command("analyse")(analyse)
