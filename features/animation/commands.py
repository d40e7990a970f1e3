"""The entries of this feature in the list of commands; light, as every command imports them."""

from gazerig.robot.cli.command_list import SPECIALIST, CommandEntry

IMPORT = CommandEntry(
    "gazerig.features.animation.cli.import_track",
    "Import an animation of another program as a track in YAML.",
    SPECIALIST,
    examples=(
        ("import my.yaml greeting.glb", "a model of gazerig describe, animated in Blender"),
        ("import my.yaml wave.csv wave --fps 24", "a table of angles"),
        (
            "import my.yaml show.json --map 3=neck_yaw",
            "Bottango; the servo at pin 3 turns the neck",
        ),
    ),
)
