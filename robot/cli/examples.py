"""Examples for every command's help, and the names a shell completes."""

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path

import typer

from gazerig.config.shipped_files import shipped_names
from gazerig.robot.cli.command_list import Examples, shipped_commands

EXAMPLES: dict[str, Examples] = {
    "run": (
        ("run --mock", "no hardware: a visitor comes, the page shows what the head does"),
        ("run --mock --world living-room", "a room with physics, seen through a rendered camera"),
        ("run my.yaml --oak", "the real rig looks through its OAK-D"),
        ("run --mock --video party.mp4", "an emulated rig before a film"),
        ("run --mock --fast --seconds 60 --seed 7 --summary -", "figures of a simulated minute"),
        ("run my.yaml --oak --page 0.0.0.0:8080", "the page for other machines too"),
        ("run my.yaml --oak --record evening.mcap", "keep every tick, to replay and judge"),
    ),
    "new": (
        ("new", "asks for board, mechanism, camera and eye distance, and writes myrig.yaml"),
        ("new eyes.yaml --board pca9685 --joints eyes-lids --camera webcam", "without questions"),
    ),
    "check": (("check my.yaml", "all faults of a file at once; no servo is touched"),),
    "describe": (
        ("describe my.yaml", "MJCF, URDF and glTF with meshes, in a folder named as the rig"),
        ("describe my.yaml --urdf out/", "URDF alone, in a folder of your choice"),
    ),
    "schema": (
        ("schema rig.schema.json", "let an editor complete and check rig files"),
        ("schema study.schema.json --of study", "and studies"),
    ),
    "kinds": (
        ("kinds", "what buses, cameras, detectors and rules there are, and from which package"),
        ("kinds --json", "the same for a program"),
    ),
    "models": (
        ("models list", "what there is, its licence, and what is here"),
        ("models fetch", "bring what is not here"),
        ("models fetch yunet", "one of them"),
        ("models fetch people --from ~/downloads", "without a network, out of downloaded files"),
    ),
    "import-gesture": (
        ("import-gesture my.yaml wave.csv wave --fps 24", "key frames of an animation program"),
    ),
    "record-camera": (
        ("record-camera seen.mcap --oak", "keep frames, depth and times of a camera"),
    ),
    "emulate": (
        ("emulate --servos 1-9:xl330-m077", "servos on a pseudo-terminal"),
        ("emulate --servos 1-6:sts3215", "servos of Feetech"),
        ("emulate --maestro 12", "a Pololu Maestro with twelve hobby servos"),
        ("emulate my.yaml", "every bus of a rig, each on its own terminal"),
    ),
    "ctl": (
        ("ctl status", "what the running rig looks at and why, guard, joints"),
        ("ctl set gaze.saccade.max_speed_deg_s 400", "change a parameter at the next tick"),
        ("ctl look 1 0.2 0.3", "the running head looks there"),
    ),
    "rigs": (
        ("ctl rigs", "name, process and page of every rig that runs"),
        ("ctl rigs --json", "the same for a program"),
    ),
    "get": (
        ("ctl get", "every parameter of the running rig"),
        ("ctl get gaze.saccade", "those of the saccades"),
        ("ctl get --differs", "what differs from the defaults"),
    ),
    "set": (("ctl set gaze.saccade.max_speed_deg_s 400", "at the next tick; not yet in the file"),),
    "save": (("ctl save my.yaml", "keep what was set, comments and order stay"),),
    "revert": (("ctl revert", "back to what the file says"),),
    "stop": (("stop", "torque off at once; the program goes on"),),
    "resume": (("ctl resume", "torque on again, slowly on"),),
    "character": (("ctl character shy", "lay a character over the running rig"),),
    "ask": (
        ("ctl ask", "the menus of the running rig, the choices in force first"),
        ("ctl ask behaviour guard", "another behaviour of its rules"),
        ("ctl ask conversation listen", "look away as a listener does"),
    ),
    "express": (
        ("ctl express", "the expressions of the running rig, the present one first"),
        ("ctl express happy", "blend to one of them"),
        ("ctl express happy --strength 0.5", "half of it"),
    ),
    "level": (
        ("ctl level mouth 0.7 --seconds 2", "the jaw 70 % open for two seconds"),
        ("ctl level mouth -", "values from standard input, one a line"),
    ),
    "play": (
        ("ctl play nod", "two nods, with the eyes on the person all the while"),
        ("ctl play laugh --count 6 --speed 1.2", "longer and faster"),
        ("ctl play --list", "the gestures, and what this rig can do of them"),
        ("ctl play none", "end the one under way"),
    ),
    "status": (
        ("ctl status", "what the running rig looks at and why, guard, joints"),
        ("ctl status --json", "the same for a program"),
    ),
    "steer": (
        ("ctl steer", "arrow keys lead the gaze; space is STOP"),
        ("ctl steer --gamepad", "stick, buttons, and Start for STOP"),
    ),
    "look": (
        ("ctl look 1 0.2 0.3", "the running head looks there"),
        ("ctl look free", "and freely again"),
    ),
    "fault": (
        ("ctl fault lose 3 for 2", "an emulated servo of the running rig is silent for 2 s"),
        ("ctl fault help", "all there are"),
    ),
    "replay": (
        ("replay evening.mcap", "on the page, with a time slider"),
        ("replay evening.mcap --rerun", "the same people, with today's code and settings"),
    ),
    "export": (
        ("export evening.mcap --csv --out gaze", "columns that eye-tracking tools read"),
        ("export evening.mcap --bids --out study", "a BIDS data set"),
    ),
}
"""Command of the core -> examples, each with what it is for."""


def all_examples() -> dict[str, Examples]:
    """Return the examples of the core and of the features that are there."""
    return EXAMPLES | {k: v for one in shipped_commands().values() for k, v in one.examples.items()}


def add_examples(app: typer.Typer, given: Mapping[str, Examples], within: str = "") -> None:
    """Add examples to the help of every command of an app.

    Args:
        app: the app.
        given: examples by command; those in a group of a feature with the group's name.
        within: the group that it is in, "" for none.
    """
    for command in app.registered_commands:
        name = command.name or str(getattr(command.callback, "__name__", "")).replace("_", "-")
        examples = given.get(f"{within} {name}") or given.get(name)
        if examples:
            command.epilog = epilog(examples)
    for group in app.registered_groups:
        part = group.typer_instance
        if part is None:
            continue
        title = part.info.name
        if not isinstance(title, str):  # a module's commands
            add_examples(part, given, within)
            continue
        if title in given:
            part.info.epilog = epilog(given[title])
        add_examples(part, given, title)


def epilog(examples: Iterable[tuple[str, str]]) -> str:
    """Write examples as lines that help keeps apart."""
    return "\n\n".join(f"gazerig {text}   ({what})" for text, what in examples)


def complete_shipped(kind: str, home: Path | None = None) -> Callable[[str], list[str]]:
    """Return what completes the names of a kind of shipped file, e.g. "characters"."""
    return lambda incomplete: [
        name for name in shipped_names(kind, home) if name.startswith(incomplete)
    ]


def complete_world(incomplete: str) -> list[str]:
    """Complete a world with physics, or other surroundings."""
    from gazerig.robot.app.surroundings import surroundings_names

    return [name for name in surroundings_names() if name.startswith(incomplete)]
