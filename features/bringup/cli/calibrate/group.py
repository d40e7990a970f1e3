"""The commands under calibrate: joints, camera, board and face; joints if none is named."""

from typing import Any

import typer
from typer.core import TyperGroup

from gazerig.features.bringup.cli.calibrate.camera import calibrate_board, calibrate_camera
from gazerig.features.bringup.cli.calibrate.face import calibrate_face
from gazerig.features.bringup.cli.calibrate.joints import calibrate_joints

_HELP = ("--help", "-h")


class DefaultCommandGroup(TyperGroup):
    """Group that passes arguments without the name of a command to the default command.

    So ``gazerig calibrate my_rig.yaml`` calibrates joints. For a rig file with the name of a
    command, write ``./face``.
    """

    default = "joints"

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Insert the default command if the arguments name none."""
        if not args or (args[0] not in self.commands and args[0] not in _HELP):
            args = [self.default, *args]
        return list(super().parse_args(ctx, args))


app = typer.Typer(
    name="calibrate",
    cls=DefaultCommandGroup,
    help="Calibrate joints (the default), camera or face, and write the result into the rig's YAML.",
    subcommand_metavar="[joints|camera|board|face] [RIG] ...",
)
app.command("joints")(calibrate_joints)
app.command("camera")(calibrate_camera)
app.command("board")(calibrate_board)
app.command("face")(calibrate_face)
