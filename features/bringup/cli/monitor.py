"""The command monitor: a live table of all servos, without touching them."""

import contextlib
from collections.abc import Callable, Iterator, Mapping
from math import inf
from typing import Annotated

import msgspec
import typer
from rich.live import Live
from rich.table import Table

from gazerig.config.rig import BusConfig, Rig
from gazerig.config.schema import load_rig
from gazerig.drivers.maestro.board import MaestroBoard
from gazerig.drivers.pca9685.board import Pca9685Board
from gazerig.drivers.serial.port import BusPort
from gazerig.features.bringup.cli.ports import (
    JsonOption,
    MockOption,
    PortOption,
    RigPorts,
    open_port,
    refuse_packages,
    rig_ports,
)
from gazerig.features.bringup.servo_kinds import servo_kind
from gazerig.features.bringup.telemetry import (
    Monitor,
    Telemetry,
    TelemetryReader,
    TelemetrySample,
    board_reader,
    smart_servo_reader,
)
from gazerig.robot.cli.progress import Console
from gazerig.robot.cli.terminal import RigArgument, clear_errors, record_signals
from gazerig.robot.model.clock import RealClock
from gazerig.robot.model.joint import JointParams

app = typer.Typer()

ESTIMATED = (
    "~ is estimated from the pulse (us); hobby servos report nothing. The board's errors are not "
    "asked for: reporting clears them"
)


@app.command()
def monitor(
    rig: RigArgument = "desk",
    seconds: Annotated[float | None, typer.Option(min=0.0, help="Stop after S seconds.")] = None,
    rate: Annotated[
        float, typer.Option(metavar="HZ", min=0.1, max=50.0, help="Readings per second.")
    ] = (5.0),
    once: Annotated[bool, typer.Option("--once", help="Print one table.")] = False,
    as_json: JsonOption = False,
    mock: MockOption = False,
    port: PortOption = None,
) -> None:
    """Show the readings of all servos; nothing is written to them, the torque stays as it is."""
    leaving = contextlib.suppress(KeyboardInterrupt)
    with clear_errors(rig, port, mock), record_signals() as stopped, leaving:
        # Nothing to park: a write that waits for a stopped terminal ends immediately.
        stopped.tolerated_requests = 0
        loaded, clock = load_rig(rig), RealClock()
        refuse_packages(loaded, "monitor")
        joints = {name: loaded.joints[name] for name in loaded.names}
        with (
            rig_ports(loaded, mock, port) as wire,
            open_readers(loaded, wire, joints) as readers,
            contextlib.ExitStack() as shown,
        ):
            watch = Monitor(readers, joints, clock.now_s, loaded.couplings.values())
            live: Live | None = None
            if not (as_json or once):
                live = shown.enter_context(Live(console=Console(), auto_refresh=False))
            for sample in _samples(watch, clock, rate, 0.0 if once else seconds, stopped):
                if as_json:
                    print(msgspec.json.encode(sample).decode(), flush=True)
                elif live is None:
                    Console().print(_table(sample, joints, rate))
                else:
                    live.update(_table(sample, joints, rate), refresh=True)


@contextlib.contextmanager
def open_readers(
    rig: Rig, wire: RigPorts, joints: Mapping[str, JointParams]
) -> Iterator[dict[str, TelemetryReader]]:
    """Open the buses of some joints for reading only."""
    with contextlib.ExitStack() as ports:
        readers = {}
        for joint in joints.values():
            if joint.bus not in readers:
                port = ports.enter_context(open_port(rig, wire, joint.bus))
                readers[joint.bus] = reader_of(port, rig.bus_named(joint.bus), joint.model)
        yield readers


def reader_of(port: BusPort, config: BusConfig, model: str) -> TelemetryReader:
    """Return the reader for a bus; model: of one of its servos."""
    if config.kind == "maestro":
        return board_reader(MaestroBoard(port, config.maestro))
    if config.kind == "pca9685":
        return board_reader(Pca9685Board(port, config.pca9685))
    return smart_servo_reader(port, servo_kind(model))


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
    caption = (
        f"{rate:g} looks a second, each {1e3 * sample.took_s:.0f} ms; {sample.unanswered} of "
        f"{sample.asked} unanswered ({sample.unanswered / sample.asked:.1%})"
    )
    # The position of a hobby servo is its pulse width in us.
    measured = dict.fromkeys(joint.model_facts.measures_position for joint in joints.values())
    units = ["step" if one else "us" for one in measured]
    if "us" in units:
        caption = f"{caption}\n{ESTIMATED}"
    table = Table(box=None, padding=(0, 1, 0, 0), caption_justify="left", caption=caption)
    goal = "goal deg" if len(units) == 1 else "goal"  # short, because a terminal has 80 columns
    for name in ("joint", "id", goal, "at deg", "/".join(units), "deg/s", "load %", "C", "V"):
        table.add_column(name, justify="left" if name == "joint" else "right", no_wrap=True)
    table.add_column("torque", no_wrap=True)
    table.add_column("errors")
    for name, seen in sample.servos.items():
        bus, servo_id = joints[name].bus, joints[name].id
        named = (name, f"{bus}:{servo_id}" if bus else f"{servo_id}")
        cells = [""] * 8 + ["[red]no answer[/red]"] if seen is None else _cells(seen)
        table.add_row(*named, *cells)
    return table


def _cells(seen: Telemetry) -> list[str]:
    """Format the values of a servo."""
    errors = f"[red]{', '.join(seen.errors)}[/red]" if seen.errors else "none"
    at, place = _number(seen.position_deg, 1), _number(seen.position_steps, 0)
    if not seen.measured:
        errors = errors if seen.errors else "-"
        at = at if at == "-" else f"~{at}"
    if seen.pulse_us is not None:
        place = f"{seen.pulse_us:g}" if seen.pulse_us else "none"
    return [
        _number(seen.goal_deg, 1), at, place, _number(seen.velocity_deg_s, 0),
        _number(None if seen.load is None else 100.0 * seen.load, 0),
        _number(seen.temperature_c, 0), _number(seen.voltage_v, 1),
        "on" if seen.torque else "off", errors,
    ]  # fmt: skip


def _number(value: float | None, digits: int) -> str:
    """Format a number, zero without a sign, and None as "-"."""
    return "-" if value is None else f"{round(value, digits) + 0.0:.{digits}f}"
