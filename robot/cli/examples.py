"""Examples for every command's help, and shell completion of names."""

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path

import typer

from gazerig.config.shipped_files import shipped_names
from gazerig.robot.cli.command_list import Examples, shipped_commands

EXAMPLES: dict[str, Examples] = {
    "run": (
        ("run --mock", "no hardware: a simulated visitor; the page shows the head"),
        ("run --mock --world living-room", "a room with physics, seen through a rendered camera"),
        ("run my.yaml --oak", "the real rig with its OAK-D camera"),
        ("run --mock --video party.mp4", "an emulated rig that watches a film"),
        ("run --mock --fast --seconds 60 --seed 7 --summary -", "figures of a simulated minute"),
        ("run my.yaml --oak --page 0.0.0.0:8080", "the page for other computers too"),
        (
            "run my.yaml --oak --record-camera seen.mcap",
            "record frames, depth and times of a camera",
        ),
        ("run my.yaml --oak --record evening.mcap", "record every tick, for reruns and reports"),
    ),
    "new": (
        ("new", "asks for board, mechanism, camera and eye distance, and writes myrig.yaml"),
        ("new eyes.yaml --board pca9685 --joints eyes-lids --camera webcam", "without questions"),
    ),
    "check": (("check my.yaml", "list all faults of a file; no servo is contacted"),),
    "describe": (
        ("describe my.yaml", "MJCF, URDF and glTF with meshes, in a folder named as the rig"),
        ("describe my.yaml --urdf out/", "only URDF, in a given folder"),
    ),
    "models": (
        ("models list", "list the files with their licences and whether they are installed"),
        ("models fetch", "download the missing files"),
        ("models fetch yunet", "only this one"),
        ("models fetch people --from ~/downloads", "offline, from downloaded files"),
    ),
    "door": (
        ("door", "list the doors"),
        ("door voice-assistant", "follow the Linux Voice Assistant of this computer"),
        ("door wyoming --bind 0.0.0.0:10601", "be the loudspeaker of satellites on the network"),
    ),
    "emulate": (
        ("emulate --servos 1-9:xl330-m077", "servos on a pseudo-terminal"),
        ("emulate --servos 1-6:sts3215", "Feetech servos"),
        ("emulate --maestro 12", "a Pololu Maestro with twelve hobby servos"),
        ("emulate my.yaml", "every bus of a rig, each on its own terminal"),
    ),
    "ctl": (
        ("ctl status", "target and its reason, guard, joints of the running rig"),
        ("ctl set gaze.saccade.max_speed_deg_s 400", "change a parameter at the next tick"),
        ("ctl look 1 0.2 0.3", "make the running head look there"),
    ),
    "rigs": (
        ("ctl rigs", "name, process and page of every running rig"),
        ("ctl rigs --json", "the same for programs"),
    ),
    "get": (
        ("ctl get", "every parameter of the running rig"),
        ("ctl get gaze.saccade", "only parameters of saccades"),
        ("ctl get --differs", "only values that differ from the defaults"),
    ),
    "set": (
        ("ctl set gaze.saccade.max_speed_deg_s 400", "at the next tick; not saved in the file"),
    ),
    "save": (("ctl save my.yaml", "save changed values; comments and order stay"),),
    "revert": (("ctl revert", "restore the values of the file"),),
    "stop": (("stop", "torque off immediately; the program continues"),),
    "resume": (("ctl resume", "torque on again, with a slow start"),),
    "character": (("ctl character shy", "apply a character to the running rig"),),
    "ask": (
        ("ctl ask", "menus of the running rig, the active choices first"),
        ("ctl ask behaviour guard", "choose another behaviour of its rules"),
        ("ctl ask conversation listen", "avert the gaze like a listener"),
    ),
    "express": (
        ("ctl express", "expressions of the running rig, the present one first"),
        ("ctl express happy", "blend to an expression"),
        ("ctl express happy --strength 0.5", "at half strength"),
    ),
    "level": (
        ("ctl level mouth 0.7 --seconds 2", "the jaw 70 % open for two seconds"),
        ("ctl level mouth -", "values from standard input, one per line"),
    ),
    "play": (
        ("ctl play nod", "nod twice; the eyes stay on the person"),
        ("ctl play laugh --count 6 --speed 1.2", "longer and faster"),
        ("ctl play --list", "the tracks, and whether this rig can play them"),
        ("ctl play none", "end all"),
    ),
    "talk": (
        ("ctl talk listening --person 1", "look as a listener, until the next state"),
        ('ctl talk speaking --text "Good morning"', "look as a speaker; the end is estimated"),
        ("ctl talk idle", "end the conversation"),
    ),
    "say": (
        ('ctl say "Hello, my name is Bob."', "a text, with the mouth; needs espeak-ng or piper"),
        ("ctl say hello.wav", "a sound file"),
        ("ctl say - --rate 22050", "samples from standard input, as they arrive"),
    ),
    "status": (
        ("ctl status", "target and its reason, guard, joints of the running rig"),
        ("ctl status --json", "the same for programs"),
    ),
    "look": (
        ("ctl look 1 0.2 0.3", "make the running head look there"),
        ("ctl look free", "let it choose its targets again"),
    ),
    "fault": (
        ("ctl fault lose 3 for 2", "an emulated servo of the running rig is silent for 2 s"),
        ("ctl fault help", "list all faults"),
    ),
    "rerun": (
        ("rerun evening.mcap", "the same input, with the present code and settings"),
        ("rerun evening.mcap my.yaml", "with the settings of this rig"),
    ),
    "export": (("export evening.mcap --out gaze", "tables for eye-tracking tools"),),
}
"""Command of the core -> examples, each with its purpose."""


def all_examples() -> dict[str, Examples]:
    """Return the examples of the core and of the installed features."""
    return EXAMPLES | {k: v for one in shipped_commands().values() for k, v in one.examples.items()}


def add_examples(app: typer.Typer, given: Mapping[str, Examples], within: str = "") -> None:
    """Add examples to the help of every command of an app.

    Args:
        app: The app.
        given: Examples by command; for a feature's group of commands with the group's name.
        within: Group that contains the app, "" for none.
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
        if not isinstance(title, str):  # commands of a module
            add_examples(part, given, within)
            continue
        if title in given:
            part.info.epilog = epilog(given[title])
        add_examples(part, given, title)


def epilog(examples: Iterable[tuple[str, str]]) -> str:
    """Format examples as separate lines of the help."""
    return "\n\n".join(f"gazerig {text}   ({what})" for text, what in examples)


def complete_shipped(kind: str, home: Path | None = None) -> Callable[[str], list[str]]:
    """Return the completion function for names of a kind of shipped file, e.g. "characters"."""
    return lambda incomplete: [
        name for name in shipped_names(kind, home) if name.startswith(incomplete)
    ]


def complete_world(incomplete: str) -> list[str]:
    """Complete a world with physics, or other surroundings."""
    from gazerig.robot.app.surroundings import surroundings_names

    return [name for name in surroundings_names() if name.startswith(incomplete)]
