"""Commands that tune and steer a rig in another terminal: ctl get, set, save ... and stop."""

import contextlib
import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from math import degrees
from pathlib import Path
from typing import Annotated, Any

import msgspec
import typer

from gazerig.config.faults import ConfigFault
from gazerig.drivers.errors import DriverError, SetupError
from gazerig.drivers.sound.params import KINDS
from gazerig.params import unknown_text
from gazerig.robot.cli.options import PidOption
from gazerig.robot.cli.terminal import FAULT, clear_errors, confirm, say
from gazerig.robot.model.clock import RealClock
from gazerig.robot.model.commands import (
    NO_TRACK,
    AnyCommand,
    Ask,
    Command,
    Fault,
    Find,
    Look,
    LookAt,
    LookAtPerson,
    Parameters,
    Play,
    ReadMenus,
    Resume,
    Revert,
    Save,
    Say,
    Stop,
    Tracks,
    Unsaved,
)
from gazerig.robot.model.parameter import ParamChange, Parameter, SavedFile
from gazerig.robot.model.reply import Progress, command_outcome
from gazerig.robot.net.client import RobotClient, connect_to_all, is_chosen

ctl = typer.Typer(
    name="ctl",
    help="Control a rig that runs in another terminal: parameters, gaze target, behaviour.",
    no_args_is_help=True,
)
app = typer.Typer()
app.add_typer(ctl)

_LAST_MESSAGES = 5
_NEGATIVE = {"ignore_unknown_options": True}
"""Click settings: -3 is a number, not an option."""
JsonOption = Annotated[bool, typer.Option("--json", help="Print JSON.")]


@contextlib.contextmanager
def connect(pid: str | None, who: str = "") -> Iterator[RobotClient]:
    """Connect to the running rig; errors end the command with one line."""
    with clear_errors(), RobotClient.connect(pid, who and f"gazerig ctl {who}") as rig:
        yield rig


@ctl.command()
def rigs() -> None:
    """List the running rigs: name, rig, process, address of the page with its token."""
    with clear_errors():
        found = connect_to_all()
        for rig in found:
            with rig:
                try:
                    now = rig.status()
                except DriverError as error:  # it is ending or hangs
                    say(f"process {rig.pid}: {error}")
                    continue
                print(
                    *(now[key] for key in ("name", "rig", "pid", "page") if now.get(key)), sep="  "
                )
    if not found:
        say("no rig is running: start one with gazerig run ...")


@ctl.command()
def get(
    prefix: Annotated[
        str,
        typer.Argument(metavar="KEY", help="A key, or the start of keys."),
    ] = "",
    pid: PidOption = None,
) -> None:
    """Show the running rig's parameters: value, unit, default; * marks unsaved values."""
    with connect(pid) as rig:
        values = rig.get(prefix)
        found = rig.ask(Parameters(prefix), tuple[Parameter, ...])
        if not values:
            raise SetupError(f"{prefix}: no key begins with it; gazerig ctl get lists all")
        unsaved = {change.key for change in rig.ask(Unsaved(), tuple[ParamChange, ...])}
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
    """Choose a behaviour, a character, or talk, listen or think; or list all choices."""
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
            metavar="X Y Z | person N | free",
            help="Metres ahead, left and up of the neck; a person's number; or free.",
        ),
    ],
    pid: PidOption = None,
) -> None:
    """Make the running head look at a target from now on, or look freely again."""
    with connect(pid, "look") as rig:
        command = read_look(where)
        if command == LookAt(None):
            rig.send(command)
            say("it looks freely")
        else:
            rig.send(command)
            say("it looks there, until: gazerig ctl look free")


@ctl.command()
def find(
    sought: Annotated[
        str, typer.Argument(metavar="N | left | right | anybody", help="A person, or a side.")
    ] = "anybody",
    pid: PidOption = None,
) -> None:
    """Make the running head search for a person; print who is where, or not found."""
    wanted: Any = int(sought) if sought.isdecimal() else sought
    with connect(pid, "find") as rig:
        reply, clock, end = rig.send(Find(wanted)), RealClock(), None
        while end is None:
            clock.sleep_until(clock.now_s() + 0.1)
            if (state := rig.state()[0]) is not None:
                end = command_outcome(reply, Progress(state.client_control, state.tracks))
    say(f"{end[0]}: {end[1]}")
    if end[0] != "arrived":
        raise typer.Exit(FAULT)


@ctl.command()
def play(
    track: Annotated[
        str | None,
        typer.Argument(help="A track, e.g. nod; none ends all tracks; without it, all are listed."),
    ] = None,
    pid: PidOption = None,
) -> None:
    """Play a track on the running head, or list all tracks with their fit to this rig."""
    with connect(pid, "play") as rig:
        if track is None:
            for one in rig.ask(Tracks(), tuple[dict[str, Any], ...]):
                say(_track_line(one))
            return
        say(rig.send(Play("" if track == NO_TRACK else track)).text() or "all tracks end")


@ctl.command(name="say")
def say_aloud(
    what: Annotated[
        str,
        typer.Argument(metavar="FILE | TEXT", help="A sound file, by its ending, or a text."),
    ],
    pid: PidOption = None,
) -> None:
    """Say a sound file or a text on the running head, with the mouth of a rig that has one."""
    with connect(pid, "say") as rig:
        if Path(what).suffix.lower() in KINDS and Path(what).is_file():
            what = str(Path(what).absolute())
        say(rig.send(Say(what)).text())


@ctl.command()
def do(
    command: Annotated[
        str,
        typer.Argument(
            metavar="JSON", help="As programs send it: docs/connect-your-program.md lists all."
        ),
    ],
    pid: PidOption = None,
) -> None:
    """Send any command to the running head, as JSON; "stay": true keeps it after this one."""
    with connect(pid, "do") as rig:
        try:
            read: Command = msgspec.json.decode(command, type=AnyCommand)
        except ValueError as error:
            raise SetupError(f"{command}: {error}") from None
        say(rig.send(read).text() or "done")


@ctl.command()
@app.command()
def stop(
    why: Annotated[str, typer.Argument(help="Reason for the log.")] = "gazerig stop",
    pid: PidOption = None,
) -> None:
    """Switch the torque of every running rig off at once; nothing parks, the programs continue."""
    with clear_errors():
        rigs = connect_to_all(who="gazerig stop")
        with ThreadPoolExecutor(len(rigs) or 1) as pool:  # one that hangs delays no other
            stopped = [*pool.map(lambda rig: _stop(rig, why, pid), rigs)]
        if not any(one is not None for one in stopped):
            RobotClient.connect(pid)  # raises the reason
    if False in stopped:
        raise typer.Exit(FAULT)


def _stop(rig: RobotClient, why: str, which: str | None) -> bool | None:
    """Stop a rig and return whether it confirms it, None if another one is meant."""
    with rig:
        if which is not None and not is_chosen(rig, which):
            return None
        try:
            rig.send(Stop(why))
        except DriverError as error:
            say(f"{rig.pid}: NOT KNOWN TO HAVE STOPPED, press the emergency stop: {error}")
            return False
    say(f"{rig.pid}: torque is off; gazerig ctl resume continues")
    return True


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
        rig.send(Resume(confirmed=True))
        say("torque is on; it continues slowly")


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
        SetupError: a value is missing or not YAML.
    """
    if len(pairs) % 2:
        raise SetupError(
            f"{pairs[-1]}: a value is missing; gazerig ctl set KEY VALUE [KEY VALUE ...]"
        )
    rows = zip(pairs[::2], pairs[1::2], strict=True)
    return {key: read_value(key, text) for key, text in rows}


def read_value(key: str, text: str) -> Any:
    """Return a value parsed as YAML, like the text after a key in a file.

    Raises:
        SetupError: it is not a YAML value.
    """
    from gazerig.config.entries import parse

    faults: list[ConfigFault] = []
    document = parse("", f"value: {text}\n", faults)
    if document is None or faults:
        raise SetupError(f"{key}: {faults[0].rule}")
    held = document.data
    if set(held) != {"value"}:
        raise SetupError(f"{key}: {text!r} is more than one value; write lists as [1, 2]")
    return held["value"]


def read_look(words: Sequence[str]) -> Look:
    """Return the gaze target of the arguments: X Y Z in metres, "person" N, or "free".

    Raises:
        SetupError: the words are not a target.
    """
    try:
        match words:
            case ["free"]:
                return LookAt(None)
            case ["person", number]:
                return LookAtPerson(int(number), stay=True)
            case [x, y, z]:
                return LookAt((float(x), float(y), float(z)), stay=True)
    except ValueError:
        pass
    raise SetupError(
        f"{' '.join(words)}: give X Y Z in metres (ahead, left, up), person N, or free"
    )


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
        f"guard: {'; '.join((now['level'], *now['reasons']))}",
        *(f"camera: {text}" for text in now.get("camera", ())),
        f"joints in deg: {joints}",
        f"not saved: {_count_text(unsaved)}; gazerig ctl save saves" if unsaved else "all saved",
        *(f"said: {text}" for text in now["said"][-_LAST_MESSAGES:]),
    ]


def _track_line(track: Mapping[str, Any]) -> str:
    head = f"{track['name']:<14}{track['description']}"
    if track["refused"]:
        return f"{head}; not on this rig: {track['refused']}"
    limited = track["limited"] and f"; {track['limited']}"
    return f"{head} ({track['duration_s']:.1f} s{limited})"


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
    return value if isinstance(value, str) else json.dumps(value)


def _count_text(number: int) -> str:
    return f"{number} value" if number == 1 else f"{number} values"


def _print_lines(lines: Iterable[str]) -> None:
    for line in lines:
        print(line)
