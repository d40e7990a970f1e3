"""Commands that tune and steer a rig in another terminal: ctl get, set, save ... and stop."""

import contextlib
import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from enum import StrEnum
from math import degrees, inf, radians
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated, Any, cast, get_args

import typer
from msgspec import structs
from typer.core import TyperGroup

from gazerig.config.faults import ConfigError
from gazerig.drivers.errors import DriverError, SetupError
from gazerig.params import unknown_text
from gazerig.robot.cli import animation
from gazerig.robot.cli.options import PidOption
from gazerig.robot.cli.terminal import FAULT, clear_errors, confirm, say
from gazerig.robot.model.clock import RealClock
from gazerig.robot.model.commands import (
    FAR_M,
    Ask,
    Character,
    Fault,
    Look,
    LookAt,
    LookAtDirection,
    LookAtInHead,
    LookAtPerson,
    LookAtPixel,
    Parameters,
    ReadMenus,
    Revert,
    Save,
    Talk,
    TalkOrder,
    Unsaved,
)
from gazerig.robot.model.parameter import ParamChange, Parameter, SavedFile
from gazerig.robot.net.client import RobotClient, connect_to_all

ctl = typer.Typer(
    name="ctl",
    help="Control a rig that runs in another terminal: parameters, gaze target, behaviour.",
    no_args_is_help=True,
)
app = typer.Typer()
app.add_typer(ctl)
ctl.add_typer(animation.app)

_CONTROL_CHECK_S = 0.2
_LAST_MESSAGES = 5
_NEGATIVE = {"ignore_unknown_options": True}
"""Click settings: -3 is a number, not an option."""
_TalkState = StrEnum("_TalkState", {name: name for name in get_args(TalkOrder)})  # type: ignore[misc]
JsonOption = Annotated[bool, typer.Option("--json", help="Print JSON.")]


@ctl.callback()
def select_rig(context: typer.Context, rig: PidOption = None) -> None:
    """Control a rig that runs in another terminal: parameters, gaze target, behaviour."""
    if rig is not None and isinstance(context.command, TyperGroup):
        context.default_map = {name: {"pid": rig} for name in context.command.commands}


@contextlib.contextmanager
def connect(pid: str | None, who: str = "") -> Iterator[RobotClient]:
    """Connect to the running rig; errors end the command with one line."""
    with clear_errors(), RobotClient.connect(pid, who and f"gazerig ctl {who}") as rig:
        yield rig


def complete_key(incomplete: str) -> list[str]:
    """Complete a key of the running rig."""
    with contextlib.suppress(DriverError), RobotClient.connect() as rig:
        return list(rig.get(incomplete))
    return []


@ctl.command()
def rigs(as_json: JsonOption = False) -> None:
    """List the running rigs: name, rig, process, address of the page with its token."""
    with clear_errors():
        found = []
        for rig in connect_to_all():
            with rig:
                now = rig.status()
                found.append({key: now.get(key) for key in ("name", "rig", "pid", "page")})
    if as_json:
        print(json.dumps(found, indent=2))
        return
    for row in found:
        print("  ".join(str(value) for value in row.values() if value is not None))
    if not found:
        say("no rig is running: start one with gazerig run ...")


@ctl.command()
def get(
    prefix: Annotated[
        str,
        typer.Argument(
            metavar="KEY", help="A key, or the start of keys.", autocompletion=complete_key
        ),
    ] = "",
    differs: Annotated[
        bool, typer.Option("--differs", help="Only values that differ from the defaults.")
    ] = False,
    as_json: JsonOption = False,
    pid: PidOption = None,
) -> None:
    """Show the running rig's parameters: value, unit, default; * marks unsaved values."""
    with connect(pid) as rig:
        values = rig.get(prefix)
        found = [
            param
            for param in rig.ask(Parameters(prefix), tuple[Parameter, ...])
            if not differs or _value_text(values[param.key]) != _value_text(param.default)
        ]
        if not values:
            raise SetupError(f"{prefix}: no key begins with it; gazerig ctl get lists all")
        unsaved = {change.key for change in rig.ask(Unsaved(), tuple[ParamChange, ...])}
    if as_json:
        print(json.dumps({param.key: values[param.key] for param in found}, indent=2))
        return
    _print_lines(_table(found, values, unsaved))
    if len(found) == 1:
        print(_rule_text(found[0]))


@ctl.command("set", context_settings=_NEGATIVE)
def put(
    pairs: Annotated[
        list[str],
        typer.Argument(
            metavar="KEY VALUE [KEY VALUE ...]",
            help="Values as in the YAML: 0.5, true, markov, [1, 2].",
        ),
    ],
    pid: PidOption = None,
) -> None:
    """Change parameters of the running rig at its next tick, all of them or none."""
    with clear_errors():
        changes = read_pairs(pairs)
    with connect(pid) as rig:
        notes = rig.set_many(changes)
        unsaved = len(rig.ask(Unsaved(), tuple[ParamChange, ...]))
    _print_lines(notes)
    if not notes:
        say("all of these values are already active")
    if unsaved:
        say(
            f"not saved yet: {_count_text(unsaved)}; gazerig ctl save saves, gazerig ctl revert undoes"
        )


@ctl.command()
def save(
    path: Annotated[
        Path | None, typer.Argument(help="YAML file; default: the rig's own file.")
    ] = None,
    pid: PidOption = None,
) -> None:
    """Write changed values into the rig's YAML; comments stay, the old file is kept as a backup."""
    with connect(pid) as rig:
        whole = str(path.expanduser().absolute()) if path is not None else None
        saved = rig.ask(Save(whole), SavedFile)
    _print_lines(map(str, saved.changes))
    if not saved.changes:
        say(f"{saved.path} already contains all values: nothing to save")
        return
    kept = f"; backup: {saved.backup}" if saved.backup is not None else ""
    say(f"{saved.path}: {_count_text(len(saved.changes))} written{kept}")


@ctl.command()
def revert(pid: PidOption = None) -> None:
    """Apply the values of the rig's file again."""
    with connect(pid) as rig:
        notes = rig.change(Revert())
    _print_lines(notes)
    say(f"{_count_text(len(notes))} undone")


@ctl.command()
def character(
    name: Annotated[
        str,
        typer.Argument(help="Name of a shipped character."),
    ],
    pid: PidOption = None,
) -> None:
    """Apply another character to the running rig."""
    with connect(pid) as rig:
        _print_lines(rig.change(Character(name)))
        say(f"character {name} is active")


@ctl.command()
def ask(
    menu: Annotated[
        str | None,
        typer.Argument(help="Without it, all menus are listed."),
    ] = None,
    choice: Annotated[
        str | None,
        typer.Argument(help="Without it, its choices are listed."),
    ] = None,
    pid: PidOption = None,
) -> None:
    """Choose a behaviour, or talk, listen or think, on the running head; or list all choices."""
    with connect(pid) as rig:
        if menu is not None and choice is not None:
            rig.send(Ask(menu, choice))
            say(f"{menu} {choice} is active")
            return
        menus = rig.ask(ReadMenus(), dict[str, tuple[str, ...]])
        if menu is not None and menu not in menus:
            raise SetupError(unknown_text("menu", menu, menus))
        shown = menus if menu is None else {menu: menus[menu]}
        _print_lines(
            f"{name}: {', '.join((f'{first} (in force)', *others))}"
            for name, (first, *others) in shown.items()
        )


@ctl.command()
def status(
    as_json: JsonOption = False,
    pid: PidOption = None,
) -> None:
    """Print the state of the running rig: target and reason, guard, joints, its last messages."""
    with connect(pid) as rig:
        now = rig.status()
    if as_json:
        print(json.dumps(now, indent=2))
    else:
        _print_lines(state_lines(now))


@ctl.command(context_settings=_NEGATIVE)
def look(
    where: Annotated[
        list[str],
        typer.Argument(
            metavar="X Y Z | person N | pixel X Y | direction YAW PITCH | free",
            help="Metres ahead, left and up of the neck; a person's number; a pixel of the frame; "
            "degrees to the left and up; or free.",
        ),
    ],
    head: Annotated[
        bool,
        typer.Option("--head", help="X Y Z or YAW PITCH are relative to the present head pose."),
    ] = False,
    distance: Annotated[
        float | None, typer.Option(metavar="M", help="Distance of a pixel or direction, metres.")
    ] = None,
    stay: Annotated[
        bool,
        typer.Option("--stay", help="Return immediately; the head looks there until: look free."),
    ] = False,
    seconds: Annotated[
        float | None,
        typer.Option(min=0.0, help="Look there for S seconds; otherwise until Ctrl-C."),
    ] = None,
    pid: PidOption = None,
) -> None:
    """Make the running head look at a target while this command runs, or look freely again."""
    with clear_errors():
        command = read_look(where, head, distance)
        with RobotClient.connect(pid, "gazerig ctl look") as rig:
            if command == LookAt(None):
                rig.send(LookAt(None))
                say("it looks freely")
                return
            reply = rig.send(structs.replace(command, stay=stay))
            until = "Ctrl-C" if seconds is None else f"{seconds:g} s have passed"
            say(f"{reply.text()}, until: {'gazerig ctl look free' if stay else until}")
            if stay:
                return
            # Until Ctrl-C or until another client controls the gaze.
            clock = RealClock()
            end_s = clock.now_s() + (inf if seconds is None else seconds)
            with contextlib.suppress(KeyboardInterrupt):
                while rig.in_control and clock.now_s() < end_s:
                    clock.sleep_until(min(end_s, clock.now_s() + _CONTROL_CHECK_S))
            if rig.in_control:
                rig.send(LookAt(None))
                say("it looks freely")
                return
            now = rig.status()
            stopped = f"it was stopped: {now['stopped']}" if now["stopped"] else "it looks freely"
            say(f"controlled by {now['controlled_by']}" if now["controlled_by"] else stopped)


@ctl.command()
@app.command()
def stop(
    why: Annotated[str, typer.Argument(help="Reason for the log.")] = "gazerig stop",
    pid: PidOption = None,
) -> None:
    """Switch the torque of every running rig off at once; nothing parks, the programs continue."""
    with clear_errors():
        rigs = connect_to_all(pid, "gazerig stop")
        if not rigs:
            RobotClient.connect(pid)  # raises the reason
        failed = False
        for rig in rigs:
            try:
                with rig:
                    rig.stop(why)
            except DriverError as error:
                failed = True
                say(f"{rig.pid}: NOT KNOWN TO HAVE STOPPED, press the emergency stop: {error}")
            else:
                say(f"{rig.pid}: torque is off; gazerig ctl resume continues")
    if failed:
        raise typer.Exit(FAULT)


@ctl.command()
def resume(
    yes: Annotated[
        bool, typer.Option("--confirm", "--yes", help="Do not ask: no hand is in the mechanism.")
    ] = False,
    pid: PidOption = None,
) -> None:
    """Switch the torque on again after a stop, at the present pose, and continue slowly."""
    with connect(pid, "resume") as rig:
        now = rig.status()
        if not now["stopped"]:
            say("it was not stopped: nothing to resume")
            return
        if not yes:
            say(f"stopped: {now['stopped']}")
            confirm(
                "Torque will be switched on and the head will move. Is no hand in the mechanism?",
                abort=True,
            )
        rig.resume(confirmed=True)
        say("torque is on; it continues slowly")


@ctl.command()
def talk(
    state: Annotated[_TalkState, typer.Argument(help="What the voice agent does from now on.")],
    person: Annotated[
        int | None, typer.Option(metavar="N", help="Number of the partner or addressee.")
    ] = None,
    seconds: Annotated[
        float | None, typer.Option(metavar="S", help="speaking: time until the planned end.")
    ] = None,
    text: Annotated[
        str,
        typer.Option(help="speaking: the text; without --seconds the end is estimated from it."),
    ] = "",
    pid: PidOption = None,
) -> None:
    """Report what a voice agent does, so that the running head looks as a partner; idle ends it."""
    with connect(pid, "talk") as rig:
        order = cast(TalkOrder, state.value)
        rig.send(Talk(order, person, seconds, text, stay=True))
        now = rig.status()
        conversation, ends_s = now["conversation"], now["conversation"]["ends_s"]
        planned = "" if ends_s is None else f", planned end in {ends_s - now['t_s']:.1f} s"
        say(f"conversation: {conversation['state']}{planned}")


@ctl.command(context_settings=_NEGATIVE)
def fault(
    words: Annotated[
        list[str],
        typer.Argument(
            metavar="COMMAND", help="A fault as in gazerig emulate; help lists all faults."
        ),
    ],
    pid: PidOption = None,
) -> None:
    """Inject a fault into the emulated servos, or push the head in a world."""
    with connect(pid, "fault") as rig:
        print(rig.ask(Fault(" ".join(words)), str))


def read_pairs(pairs: Sequence[str]) -> dict[str, Any]:
    """Read KEY VALUE KEY VALUE ... with values as YAML.

    Raises:
        SetupError: a value is missing or not YAML, or a key is given twice.
    """
    if len(pairs) % 2:
        raise SetupError(
            f"{pairs[-1]}: a value is missing; gazerig ctl set KEY VALUE [KEY VALUE ...]"
        )
    keys = pairs[::2]
    for key in keys:
        if keys.count(key) > 1:
            raise SetupError(f"{key}: duplicate key; give it one value")
    return {key: read_value(key, text) for key, text in zip(keys, pairs[1::2], strict=True)}


def read_value(key: str, text: str) -> Any:
    """Return a value parsed as YAML, like the text after a key in a file.

    Raises:
        SetupError: it is not a YAML value.
    """
    with TemporaryDirectory(prefix="gazerig-value-") as folder:
        file = Path(folder) / "value.yaml"
        file.write_text(f"value: {text}\n", encoding="utf-8")
        try:
            from gazerig.config.load import read_yaml

            held = read_yaml(file).data
        except ConfigError as error:
            raise SetupError(f"{key}: {error.faults[0].rule}") from None
    if set(held) != {"value"}:
        raise SetupError(f"{key}: {text!r} is more than one value; write lists as [1, 2]")
    return held["value"]


def read_look(words: Sequence[str], head: bool = False, distance_m: float | None = None) -> Look:
    """Return the gaze target of the arguments.

    Args:
        words: X Y Z in metres, "person" N, "pixel" X Y, "direction" YAW PITCH in degrees, "free".
        head: Whether a point or direction is relative to the present head pose.
        distance_m: Distance of a pixel or direction.

    Raises:
        SetupError: the words are not a target.
    """
    kind, numbers = (words[0], words[1:]) if words[0] in _NUMBERS else ("point", words)
    try:
        found = tuple(map(float, numbers))
        if len(found) != _NUMBERS[kind] or (kind == "person" and found[0] % 1.0):
            raise ValueError
    except ValueError:
        raise SetupError(
            f"{' '.join(words)}: give X Y Z in metres (ahead, left, up), person N, pixel X Y, "
            "direction YAW PITCH in degrees (left, up), or free"
        ) from None
    if kind == "free":
        return LookAt(None)
    if kind == "person":
        return LookAtPerson(int(found[0]))
    if kind == "pixel":
        return LookAtPixel((found[0], found[1]), distance_m)
    if kind == "direction":
        angles = (radians(found[0]), radians(found[1]))
        far_m = FAR_M if distance_m is None else distance_m
        return LookAtDirection(angles, "head" if head else "world", far_m)
    point = (found[0], found[1], found[2])
    return LookAtInHead(point) if head else LookAt(point)


_NUMBERS = {"point": 3, "person": 1, "pixel": 2, "direction": 2, "free": 0}
"""Kinds of targets, and the number of their numbers."""


def state_lines(now: Mapping[str, Any]) -> list[str]:
    """Return the result of ``RobotClient.status`` as lines of text."""
    lines = [f"rig: {now.get('rig', '')}, process {now.get('pid', '')}"]
    if not now["ticks"]:
        return [*lines, "it has just started: nothing is known yet"]
    if now["stopped"]:
        lines.append(f"STOPPED, torque off: {now['stopped']}; gazerig ctl resume continues")
    joints = ", ".join(
        f"{name} {degrees(one['measured_rad']):.1f}" for name, one in now["joints"].items()
    )
    unsaved, gaze = now["unsaved"], now["gaze"]
    return [
        *lines,
        *([f"controlled by {now['controlled_by']}"] if now["controlled_by"] else []),
        f"looks at: {gaze['target']} - {gaze['reason']} ({gaze['phase']})",
        *_talk_lines(now),
        f"guard: {'; '.join((now['level'], *now['reasons']))}",
        *(f"camera: {text}" for text in now.get("camera", ())),
        f"joints in deg: {joints}",
        f"not saved: {_count_text(unsaved)}; gazerig ctl save saves" if unsaved else "all saved",
        *(f"said: {text}" for text in now["said"][-_LAST_MESSAGES:]),
    ]


def _talk_lines(now: Mapping[str, Any]) -> list[str]:
    """Return a line with the state of the conversation, none without one."""
    talk = now["conversation"]
    if talk["state"] == "idle":
        return []
    partner = f" with person {talk['partner']}" if talk["partner"] is not None else ""
    return [f"conversation: {talk['state']}{partner}, reported by {talk['who'] or 'a client'}"]


def _table(found: Iterable[Parameter], values: dict[str, Any], unsaved: set[str]) -> Iterator[str]:
    """Format parameters in columns without cutting text, as programs read the lines too."""
    row = "{:1} {:40} {:12} {:8} {:12} {}"
    yield row.format("", "key", "value", "unit", "default", "").rstrip()
    for param in found:
        value, default = _value_text(values[param.key]), _value_text(param.default)
        mark = "*" if param.key in unsaved else ""
        usual = "" if default == value else default
        later = "next start" if param.live.startswith("next start") else ""
        yield row.format(mark, param.key, value, param.unit, usual, later).rstrip()


def _rule_text(param: Parameter) -> str:
    """Return description and range of one parameter, and when a change takes effect."""
    bounds = "" if param.low is None or param.high is None else f"{param.low:g} .. {param.high:g}"
    choices = ", ".join(map(_value_text, param.choices))
    allowed = " ".join(part for part in (bounds, param.unit if bounds else "") if part) or choices
    return "; ".join(
        part for part in (param.description, allowed, f"changes at the {param.live}") if part
    )


def _value_text(value: object) -> str:
    """Return a value as text that ``set`` accepts."""
    return value if isinstance(value, str) else json.dumps(value)


def _count_text(number: int) -> str:
    return f"{number} value" if number == 1 else f"{number} values"


def _print_lines(lines: Iterable[str]) -> None:
    for line in lines:
        print(line)
