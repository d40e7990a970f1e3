"""The command monitor: a live table of all servos, without touching them."""

import json
from collections.abc import Callable, Iterator, Mapping
from math import inf
from typing import Annotated

import typer
from rich.console import Console
from rich.live import Live
from rich.table import Table

from config.schema import load_rig
from robot.bringup.monitor import Look, Monitor, Sample, as_json
from robot.cli.terminal import RigArgument, clear_errors, signals
from robot.cli.wires import MockOption, PortOption, registers, wires
from robot.clock import RealClock
from robot.joint import JointParams

app = typer.Typer()


@app.command()
def monitor(
    rig: RigArgument = "desk",
    seconds: Annotated[float | None, typer.Option(min=0.0, help="Stop after S seconds.")] = None,
    rate: Annotated[
        float, typer.Option(metavar="HZ", min=0.1, max=50.0, help="Looks a second.")
    ] = (5.0),
    once: Annotated[bool, typer.Option("--once", help="Print one table.")] = False,
    as_lines: Annotated[bool, typer.Option("--json", help="Print one JSON line a look.")] = False,
    mock: MockOption = False,
    port: PortOption = None,
) -> None:
    """Watch all servos; reads alone: nothing is written, torque stays as it is."""
    with clear_errors(), signals() as stopped:
        found, clock = load_rig(rig), RealClock()
        with (
            wires(found, mock, port) as wire,
            registers(wire.paths[""], found.bus.baud, tries=1) as (regs, line),
        ):
            joints = {name: found.joints[name] for name in found.names}
            watch = Monitor(regs, joints, line.now_s)
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


def _samples(
    watch: Monitor,
    clock: RealClock,
    rate: float,
    seconds: float | None,
    stopped: Callable[[], str | None],
) -> Iterator[Sample]:
    """Look at absolute slots until the time is over or a signal comes; at least once."""
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


def _table(sample: Sample, joints: Mapping[str, JointParams], rate: float) -> Table:
    """Lay a sample out as a table."""
    share = sample.unanswered / sample.asked
    table = Table(
        box=None,
        padding=(0, 1, 0, 0),
        caption_justify="left",
        caption=f"{rate:g} looks a second, each {1e3 * sample.took_s:.0f} ms; "
        f"{sample.unanswered} of {sample.asked} unanswered ({share:.1%})",
    )
    table.add_column("joint", no_wrap=True)
    table.add_column("id", justify="right", no_wrap=True)
    for name in ("goal deg", "at deg", "step", "deg/s", "load %", "C", "V"):
        table.add_column(name, justify="right", no_wrap=True)
    table.add_column("torque", no_wrap=True)
    table.add_column("errors")
    for name, look in sample.looks.items():
        table.add_row(name, str(joints[name].id), *_row(look))
    return table


def _row(look: Look | None) -> tuple[str, ...]:
    if look is None:
        return ("",) * 8 + ("[red]no answer[/red]",)
    errors = f"[red]{', '.join(look.errors)}[/red]" if look.errors else "none"
    return (
        _number(look.goal_deg, 1),
        _number(look.position_deg, 1),
        str(look.position_steps),
        _number(look.velocity_deg_s, 0),
        _number(100.0 * look.load, 0),
        f"{look.temperature_c}",
        f"{look.voltage_v:.1f}",
        "on" if look.torque else "off",
        errors,
    )


def _number(value: float, digits: int) -> str:
    """Write a number, and zero without a sign."""
    return f"{round(value, digits) + 0.0:.{digits}f}"
