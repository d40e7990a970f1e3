"""A rig that holds its pose while a command moves it; in all cases it ends with the torque off."""

import contextlib
from collections.abc import Callable, Iterator, Mapping

import typer

from gazerig.config.rig import Rig
from gazerig.features.bringup.manual_control import RATE_HZ, ManualControl, Step, park_slowly
from gazerig.robot.app.bus_wiring import bus_names, can_be_released, guarded_rig_bus, has_watchdog
from gazerig.robot.app.rig_limits import limits, park_rad
from gazerig.robot.app.rig_weight import rest_park_deg
from gazerig.robot.cli.terminal import FAULT, say
from gazerig.robot.control.body import Body
from gazerig.robot.control.interrupts import Interrupts
from gazerig.robot.control.power_down import PowerDown
from gazerig.robot.model.clock import RealClock
from gazerig.robot.safety.guard import Guard


@contextlib.contextmanager
def holding_rig(
    rig: Rig,
    paths: Mapping[str, str],
    speed_deg_s: float,
    stopped: Callable[[], str | None],
    interrupts: Interrupts,
    park: bool = True,
    watch: Callable[[Step], None] | None = None,
) -> Iterator[ManualControl]:
    """Switch torque on at the present pose; at the end of the block park, torque off, close.

    Args:
        rig: the rig to move.
        paths: paths of the serial ports, by the name of the bus.
        speed_deg_s: top speed of the motion.
        stopped: returns why to end a motion, None without a reason.
        interrupts: requests to end this program.
        park: whether to park the joints at the end.
        watch: receives every step.

    Raises:
        SetupError: port or servos do not match the configuration.
        typer.Exit: not all servos confirmed the torque-off after a successful block.
    """
    body = Body(
        guarded_rig_bus(rig, paths), rig.joints, park_rad(rig), pairs=rig.couplings.values()
    )
    guard = Guard(rig.guard, limits(rig.joints), rig.names, period_s=1.0 / RATE_HZ)
    control = ManualControl(body, guard, RealClock(), speed_deg_s, stopped, watch)
    with PowerDown(
        (lambda again: park_slowly(control, rest_park_deg(rig), again)) if park else None,
        control.stop,
        say,
        interrupts,
        "torque off on all servos",
        f": {unreleased_text(rig)}",
    ) as way_out:
        way_out.switch_on(control.start)
        yield control
    if way_out.unreleased:
        raise typer.Exit(FAULT)


def holding_text(rig: Rig) -> str:
    """Return the behaviour of the servos once the torque is on."""
    measured_joints = [name for name in rig.names if rig.joints[name].model_facts.measures_position]
    without_feedback = len(rig.names) - len(measured_joints)
    if not without_feedback:
        return f"torque on: {len(measured_joints)} servos hold where they are"
    pulses = f"{without_feedback} hobby servos hold where their pulses are (estimated: they report nothing)"
    return (
        f"torque on: {len(measured_joints)} servos hold where they are, {pulses}"
        if measured_joints
        else f"pulses on: {pulses}"
    )


def unreleased_text(rig: Rig) -> str:
    """Return the behaviour of servos whose torque could not be switched off."""
    until = "until the servo power is cut, or the guardian, which tries for 10 s, reaches the port"
    texts: dict[str, None] = {}
    for bus in bus_names(rig):
        kind = rig.bus_named(bus).kind
        if not can_be_released(rig, bus):
            text = f"the {kind} servos' own watchdog stops them"
        elif has_watchdog(rig, bus):
            text = f"{kind} servos stop by their own watchdog and hold {until}"
        else:
            text = f"{kind} servos hold their last goal or pulse {until}"
        texts[text] = None
    return "; ".join(texts)
