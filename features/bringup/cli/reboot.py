"""The command ``gazerig reboot``: servos restarted one by one."""

from collections.abc import Callable
from typing import Annotated

import typer

from gazerig.config.rig import Rig
from gazerig.config.schema import load_rig
from gazerig.drivers.errors import ServoFault, SetupError
from gazerig.drivers.hobby_board.release import stop_pulses
from gazerig.drivers.maestro.line import MaestroLink
from gazerig.drivers.pca9685.board import Pca9685Board
from gazerig.drivers.serial.port import BusPort
from gazerig.features.bringup import servo_reboot
from gazerig.features.bringup.channel_test import send_home
from gazerig.features.bringup.cli.ports import (
    MockOption,
    PortOption,
    YesOption,
    bus_label,
    refuse_packages,
    rig_ports,
    setups_on,
    unopened_port,
)
from gazerig.features.bringup.servo_kinds import KINDS, ServoKind, servo_kind
from gazerig.robot.app.bus_wiring import bus_names, joints_on
from gazerig.robot.cli.rig_command import RigCommand
from gazerig.robot.cli.terminal import FAULT, RigArgument, clear_errors, confirm, say
from gazerig.robot.model.clock import RealClock

app = typer.Typer()

HIGHEST_ID: dict[str, int] = {
    "maestro": 23,
    "pca9685": 255,
    **{kind.name: kind.family.highest_id for kind in KINDS.values()},
}


@app.command(cls=RigCommand)
def reboot(
    rig: RigArgument = "desk",
    *,
    servos: Annotated[list[str], typer.Argument(metavar="ID...", help="Servo ids or joints.")],
    port: PortOption = None,
    mock: MockOption = False,
    yes: YesOption = False,
) -> None:
    """Restart servos, which clears latched errors; their torque is off afterwards."""
    with clear_errors(rig, port, mock):
        model = load_rig(rig)
        refuse_packages(model, "reboot")
        wanted: dict[str, list[int]] = {}
        for text in servos:
            bus, servo_id = _servo(model, text)
            wanted.setdefault(bus, []).append(servo_id)
        again = []
        with rig_ports(model, mock, port) as wired:
            for bus, ids in wanted.items():
                config = model.bus_named(bus)
                with unopened_port(wired.paths[bus]) as line:
                    line.setBaudRate(config.baud)
                    if config.kind in BOARDS:
                        BOARDS[config.kind](model, bus, line, yes)
                        continue
                    kind = servo_kind(setups_on(model, bus)[0].model)
                    again += [_reboot(line, kind, model, bus, one, yes) for one in ids]
    if any(again):
        raise typer.Exit(FAULT)


def _servo(rig: Rig, text: str) -> tuple[str, int]:
    """Parse the name of a joint, or a servo id; return its bus and id.

    Raises:
        SetupError: it is neither, or several buses have such ids.
    """
    if text in rig.joints:
        return rig.joints[text].bus, rig.joints[text].id
    buses = bus_names(rig)
    if text.isdecimal() and len(buses) > 1:
        having = [b for b in buses if any(rig.joints[j].id == int(text) for j in joints_on(rig, b))]
        if len(having) == 1:
            return having[0], int(text)
        named = ", ".join(bus_label(rig, bus) for bus in having or buses)
        raise SetupError(f"{text}: which bus ({named})? name the joint instead")
    most = HIGHEST_ID[rig.bus_named(buses[0]).kind]
    if text.isdecimal() and int(text) <= most:
        return buses[0], int(text)
    raise SetupError(
        f"{text}: neither an id from 0 to {most} nor a joint ({', '.join(rig.names)}) nor a rig "
        "(a file, or the name of a shipped one, before the ids)"
    )


def _reboot(line: BusPort, kind: ServoKind, rig: Rig, bus: str, servo_id: int, yes: bool) -> bool:
    """Restart one servo; return whether it still reports errors."""
    names = [joint for joint in joints_on(rig, bus) if rig.joints[joint].id == servo_id]
    name = f"{names[0]} (servo {servo_id})" if names else f"servo {servo_id}"
    baud = rig.bus_named(bus).baud
    servo_reboot.find_servo(line, kind, servo_id, baud)
    before = servo_reboot.read_snapshot(line, kind, servo_id)
    say(f"{name}: {before}")
    question = f"{name}: torque goes off: hold what it carries. Restart it?"
    if before.torque and not yes and not confirm(question, err=True):
        say(f"{name}: left as it is")
        return False
    result = servo_reboot.reboot_servo(line, kind, servo_id, baud, RealClock().sleep_until)
    say(f"{name}: back after {result.away_s:.1f} s: {result.after}")
    if result.after.errors:
        say(f"{name}: the cause is still there: gazerig doctor names the cure")
    return bool(result.after.errors)


def _maestro(rig: Rig, bus: str, line: BusPort, yes: bool) -> None:
    """Replace the restart of a Maestro: clear its errors and send it home."""
    label = bus_label(rig, bus)
    say(
        f"{label}: a Maestro has no restart over its serial line (its power switch is one); its "
        "errors can be cleared, and all its channels sent home, which is what Pololu's program "
        "set for 'On startup or error': no pulses, or a place to which servos go at once"
    )
    if not yes and not confirm("Keep fingers away. Do that?", err=True):
        say(f"{label}: left as it is")
        return
    held = send_home(MaestroLink(line, rig.bus_named(bus).maestro))
    say(f"{label}: home; errors it held, cleared now: {', '.join(held) or 'none'}")


def _pca9685(rig: Rig, bus: str, line: BusPort, yes: bool) -> None:
    """Replace the restart of a PCA9685: stop the pulses of the rig's channels.

    Raises:
        ServoFault: some pulses do not stop.
    """
    ids = tuple(rig.joints[joint].id for joint in joints_on(rig, bus))
    params = rig.bus_named(bus).pca9685
    left = stop_pulses(line, params.baud, Pca9685Board(line, params), ids)
    if left:
        raise ServoFault(
            f"{line.port_name}: channels {', '.join(map(str, left))} do not confirm that their "
            "pulses have stopped: cut the servo power; gazerig doctor names the cause"
        )
    say(
        f"{bus_label(rig, bus)}: a PCA9685 latches no errors; pulses of its {len(ids)} channels "
        "are off, and it is set up again at the next start"
    )


BOARDS: dict[str, Callable[[Rig, str, BusPort, bool], None]] = {
    "maestro": _maestro,
    "pca9685": _pca9685,
}
"""Replacement of a restart for servos without one, by the kind of bus."""
