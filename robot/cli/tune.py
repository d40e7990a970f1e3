"""Commands that tune and steer a rig in another terminal: get, set, save, stop ..."""

import json
from collections.abc import Iterable, Mapping, Sequence
from math import degrees
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from gazerig.config.faults import ConfigError
from gazerig.drivers.errors import DriverError, SetupError
from gazerig.robot.cli import animation as cli_animation
from gazerig.robot.cli import fault as cli_fault
from gazerig.robot.cli import look_and_stop
from gazerig.robot.cli import talk as cli_talk
from gazerig.robot.cli.look_and_stop import PidOption
from gazerig.robot.cli.terminal import clear_errors, say
from gazerig.robot.model.commands import Ask
from gazerig.robot.model.parameter import Parameter
from gazerig.robot.net.client import RobotClient, connect_to_all

ctl = typer.Typer(
    name="ctl",
    help="Control a rig that runs in another terminal: parameters, gaze target, behaviour.",
    no_args_is_help=True,
)


@ctl.callback()
def select_rig(context: typer.Context, rig: PidOption = None) -> None:
    """Control a rig that runs in another terminal: parameters, gaze target, behaviour."""
    if rig is not None and isinstance(context.command, TyperGroup):
        context.default_map = {name: {"pid": rig} for name in context.command.commands}


ctl.add_typer(look_and_stop.app)
ctl.add_typer(cli_animation.app)
ctl.add_typer(cli_talk.app)
ctl.add_typer(cli_fault.app)
app = typer.Typer()
app.add_typer(ctl)
app.command()(look_and_stop.stop)
_OLD_S = 1.0
"""A loop without a tick for this long is reported as delayed."""
_LAST_SAID = 5
_NEGATIVE = {"ignore_unknown_options": True}
"""Click settings: -3 is a number, not an option."""


def complete_key(incomplete: str) -> list[str]:
    """Complete a key of the running rig, or of the shipped rig if none runs."""
    try:
        with RobotClient.connect() as rig:
            return list(rig.get(incomplete))
    except DriverError:
        # Imported only here: the other commands leave keys and rules to the running rig.
        from gazerig.config.parameters import parameters
        from gazerig.config.schema import load_rig

        desk = load_rig("desk")
        return [param.key for param in parameters(desk, desk) if param.key.startswith(incomplete)]


@ctl.command()
def rigs(
    as_json: Annotated[
        bool, typer.Option("--json", help="Print a list of objects as JSON.")
    ] = False,
) -> None:
    """List the running rigs: name, rig, process, address of the page with its token."""
    with clear_errors():
        found = []
        for rig in connect_to_all():
            with rig:
                now = rig.status()
                row = {key: now.get(key) for key in ("name", "rig", "pid", "page")}
                found.append(row)
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
    as_json: Annotated[bool, typer.Option("--json", help="Print key -> value as JSON.")] = False,
    pid: PidOption = None,
) -> None:
    """Show the running rig's parameters: value, unit, default; * marks unsaved values."""
    with clear_errors(), RobotClient.connect(pid) as rig:
        values = rig.get(prefix)
        found = [param for param in rig.parameters() if param.key in values]
        if differs:
            found = [
                param
                for param in found
                if _value_text(values[param.key]) != _value_text(param.default)
            ]
        if not found and not differs:
            raise SetupError(f"{prefix}: no key begins with it; gazerig ctl get lists all")
        if as_json:
            print(json.dumps({param.key: values[param.key] for param in found}, indent=2))
            return
        unsaved = {change.key for change in rig.unsaved()}
    for line in _table(found, values, unsaved):
        print(line)
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
        with RobotClient.connect(pid) as rig:
            notes = rig.set_many(changes)
            unsaved = len(rig.unsaved())
        _print_notes(notes)
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
    with clear_errors(), RobotClient.connect(pid) as rig:
        saved = rig.save(path)
    _print_notes(map(str, saved.changes))
    if not saved.changes:
        say(f"{saved.path} already contains all values: nothing to save")
        return
    kept = f"; backup: {saved.backup}" if saved.backup is not None else ""
    say(f"{saved.path}: {_count_text(len(saved.changes))} written{kept}")


@ctl.command()
def revert(pid: PidOption = None) -> None:
    """Apply the values of the rig's file again."""
    with clear_errors(), RobotClient.connect(pid) as rig:
        notes = rig.revert()
    _print_notes(notes)
    say(f"{_count_text(len(notes))} undone")


@ctl.command()
def character(
    name: Annotated[
        str,
        typer.Argument(
            help="Name of a shipped character.",
        ),
    ],
    pid: PidOption = None,
) -> None:
    """Apply another character to the running rig."""
    with clear_errors(), RobotClient.connect(pid) as rig:
        _print_notes(rig.apply_character(name))
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
    with clear_errors(), RobotClient.connect(pid) as rig:
        if menu is not None and choice is not None:
            rig.send(Ask(menu, choice))
            say(f"{menu} {choice} is active")
            return
        menus = rig.menus()
        if menu is not None and menu not in menus:
            raise SetupError(f"{menu}: not a menu of this rig; available: {', '.join(menus)}")
        shown = menus if menu is None else {menu: menus[menu]}
        _print_notes(
            f"{name}: {', '.join((f'{first} (in force)', *others))}"
            for name, (first, *others) in shown.items()
        )


@ctl.command()
def status(
    as_json: Annotated[bool, typer.Option("--json", help="Print everything as JSON.")] = False,
    pid: PidOption = None,
) -> None:
    """Print the state of the running rig: target and reason, guard, joints, its last messages."""
    with clear_errors(), RobotClient.connect(pid) as rig:
        now = rig.status()
    if as_json:
        print(json.dumps(now, indent=2))
    else:
        _print_notes(state_lines(now))


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


def state_lines(now: Mapping[str, Any]) -> list[str]:
    """Return the result of ``RobotClient.status`` as lines of text."""
    lines = [f"rig: {now.get('rig', '')}, process {now.get('pid', '')}"]
    if not now["ticks"]:
        return [*lines, "it has just started: nothing is known yet"]
    if now["stopped"]:
        lines.append(f"STOPPED, torque off: {now['stopped']}; gazerig ctl resume continues")
    if now["age_s"] > _OLD_S:
        lines.append(f"the loop is delayed: the following data are {now['age_s']:.1f} s old")
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
        *(f"said: {text}" for text in now["said"][-_LAST_SAID:]),
    ]


def _talk_lines(now: Mapping[str, Any]) -> list[str]:
    """Return a line with the state of the conversation, none without one."""
    talk = now["conversation"]
    if talk["state"] == "idle":
        return []
    partner = f" with person {talk['partner']}" if talk["partner"] is not None else ""
    return [f"conversation: {talk['state']}{partner}, reported by {talk['who'] or 'a client'}"]


def _table(found: Iterable[Parameter], values: dict[str, Any], unsaved: set[str]) -> list[str]:
    """Format parameters in columns without cutting text, as programs read the lines too."""
    rows = [("", "key", "value", "unit", "default", "")]
    for param in found:
        value = _value_text(values[param.key])
        default = _value_text(param.default)
        rows.append(
            (
                "*" if param.key in unsaved else "",
                param.key,
                value,
                param.unit,
                "" if default == value else default,
                "next start" if param.live.startswith("next start") else "",
            )
        )
    widths = [min(max(map(len, column)), 40) for column in zip(*rows, strict=True)]
    return [
        " ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
        for row in rows
    ]


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


def _print_notes(notes: Iterable[str]) -> None:
    for note in notes:
        print(note)
