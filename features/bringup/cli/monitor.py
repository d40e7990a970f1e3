"""The command monitor: a live table of all servos, without touching them."""

import contextlib
import json
from collections.abc import Callable, Iterator, Mapping
from math import inf
from typing import Annotated

import typer
from rich.live import Live
from rich.table import Table

from gazerig.config.rig import BusConfig, Rig
from gazerig.config.schema import load_rig
from gazerig.drivers.serial.port import BusPort
from gazerig.features.bringup.cli.ports import (
    MockOption,
    PortOption,
    RigPorts,
    open_port,
    refuse_packages,
    rig_ports,
    setups_on,
)
from gazerig.features.bringup.servo_kinds import servo_kind
from gazerig.features.bringup.telemetry import (
    MaestroTelemetry,
    Monitor,
    Pca9685Telemetry,
    SmartServoTelemetry,
    TelemetryReader,
    TelemetrySample,
    as_json,
)
from gazerig.robot.app.bus_wiring import bus_names
from gazerig.robot.cli.console import Console
from gazerig.robot.cli.terminal import RigArgument, clear_errors, record_signals
from gazerig.robot.model.clock import RealClock
from gazerig.robot.model.joint import JointParams

app = typer.Typer()

ESTIMATED = (
    "~ is estimated from the pulse (us); hobby servos report nothing. The board's errors are not "
    "asked for: reporting clears them"
)
_COLUMNS = 7
_UNTOLD = "-"


@app.command()
def monitor(
    rig: RigArgument = "desk",
    seconds: Annotated[float | None, typer.Option(min=0.0, help="Stop after S seconds.")] = None,
    rate: Annotated[
        float, typer.Option(metavar="HZ", min=0.1, max=50.0, help="Readings per second.")
    ] = (5.0),
    once: Annotated[bool, typer.Option("--once", help="Print one table.")] = False,
    as_lines: Annotated[
        bool, typer.Option("--json", help="Print one line of JSON per reading.")
    ] = False,
    mock: MockOption = False,
    port: PortOption = None,
) -> None:
    """Show the readings of all servos; nothing is written to them, the torque stays as it is."""
    leaving = contextlib.suppress(KeyboardInterrupt)
    with clear_errors(rig, port, mock), record_signals() as stopped, leaving:
        stopped.tolerated_requests = (
            0  # nothing to park: a write that waits for a stopped terminal ends immediately
        )
        found, clock = load_rig(rig), RealClock()
        refuse_packages(found, "monitor")
        with rig_ports(found, mock, port) as wire, _readers(found, wire) as readers:
            joints = {name: found.joints[name] for name in found.names}
            watch = Monitor(readers, joints, clock.now_s, found.couplings.values())
            samples = _samples(watch, clock, rate, 0.0 if once else seconds, stopped)
            if as_lines:
                start_s = clock.now_s()
                for sample in samples:
                    print(json.dumps(as_json(sample, start_s)), flush=True)
            elif once:
                Console().print(_table(next(samples), joints, rate))
            else:
                with Live(console=Console(), auto_refresh=False) as live:
                    for sample in samples:
                        live.update(_table(sample, joints, rate), refresh=True)


BOARDS: Mapping[str, Callable[[BusPort, BusConfig], TelemetryReader]] = {
    "maestro": lambda port, config: MaestroTelemetry(port, config.maestro),
    "pca9685": lambda port, config: Pca9685Telemetry(port, config.pca9685),
}
"""Readers of boards, whose servos do not answer, by the kind of bus."""


@contextlib.contextmanager
def _readers(rig: Rig, wire: RigPorts) -> Iterator[dict[str, TelemetryReader]]:
    """Open every bus for reading only."""
    with contextlib.ExitStack() as ports:
        readers = {}
        for name in bus_names(rig):
            port, config = ports.enter_context(open_port(rig, wire, name)), rig.bus_named(name)
            kind = None if config.kind in BOARDS else servo_kind(setups_on(rig, name)[0].model)
            readers[name] = (
                BOARDS[config.kind](port, config)
                if kind is None
                else SmartServoTelemetry(port, kind)
            )
        yield readers


def _samples(
    watch: Monitor,
    clock: RealClock,
    rate: float,
    seconds: float | None,
    stopped: Callable[[], str | None],
) -> Iterator[TelemetrySample]:
    """Yield samples at absolute times until the time is over or a signal arrives; at least one."""
    start_s = clock.now_s()
    end_s = inf if seconds is None else start_s + seconds
    slot = 0
    while True:
        yield watch.sample()
        slot = max(slot + 1, int((clock.now_s() - start_s) * rate))
        due_s = start_s + slot / rate
        if due_s > end_s:
            return
        while clock.now_s() < due_s and not stopped():
            clock.sleep_until(min(due_s, clock.now_s() + 0.1))
        if stopped():
            return


def _table(sample: TelemetrySample, joints: Mapping[str, JointParams], rate: float) -> Table:
    """Format a sample as a table."""
    hobby = any(not joint.model_facts.measures_position for joint in joints.values())
    share = sample.unanswered / sample.request_count
    caption = (
        f"{rate:g} looks a second, each {1e3 * sample.took_s:.0f} ms; "
        f"{sample.unanswered} of {sample.request_count} unanswered ({share:.1%})"
    )
    table = Table(
        box=None,
        padding=(0, 1, 0, 0),
        caption_justify="left",
        caption=f"{caption}\n{ESTIMATED}" if hobby else caption,
    )
    table.add_column("joint", no_wrap=True)
    table.add_column("id", justify="right", no_wrap=True)
    # The position of a hobby servo is its pulse width in us.
    units = dict.fromkeys(
        "step" if joint.model_facts.measures_position else "us" for joint in joints.values()
    )
    goal = "goal deg" if len(units) == 1 else "goal"  # short, because a terminal has 80 columns
    for name in (goal, "at deg", "/".join(units), "deg/s", "load %", "C", "V"):
        table.add_column(name, justify="right", no_wrap=True)
    table.add_column("torque", no_wrap=True)
    table.add_column("errors")
    for name, look in sample.servos.items():
        bus, servo_id = joints[name].bus, joints[name].id
        named = (name, f"{bus}:{servo_id}" if bus else f"{servo_id}")
        if look is None:
            table.add_row(*named, *("",) * (_COLUMNS + 1), "[red]no answer[/red]")
            continue
        errors = "none" if look.measured else _UNTOLD
        if look.errors:
            errors = f"[red]{', '.join(look.errors)}[/red]"
        at = _number(look.position_deg, 1)
        place = _UNTOLD if look.position_steps is None else str(look.position_steps)
        if look.pulse_us is not None:
            place = f"{look.pulse_us:g}" if look.pulse_us else "none"
        table.add_row(
            *named,
            _number(look.goal_deg, 1),
            at if look.measured or at == _UNTOLD else f"~{at}",
            place,
            _number(look.velocity_deg_s, 0),
            _number(None if look.load is None else 100.0 * look.load, 0),
            _number(look.temperature_c, 0),
            _number(look.voltage_v, 1),
            "on" if look.torque else "off",
            errors,
        )
    return table


def _number(value: float | None, digits: int) -> str:
    """Format a number, zero without a sign, and None as "-"."""
    return _UNTOLD if value is None else f"{round(value, digits) + 0.0:.{digits}f}"
