"""Calibrating the joints of one bus with a person at the terminal, by what their servos can do."""

import contextlib
from collections.abc import Callable, Iterator, Sequence
from enum import StrEnum
from typing import NamedTuple

from gazerig.config.rig import Rig
from gazerig.drivers.errors import ServoFault, ServoMissing, SetupError
from gazerig.drivers.serial.port_by_path import port_of
from gazerig.features.bringup.calibration.endstop_search import StopSearchParams
from gazerig.features.bringup.calibration.hobby_access import HobbyServoHandle
from gazerig.features.bringup.calibration.joint_calibration import (
    Calibration,
    CalibrationRefused,
    LinkageFit,
)
from gazerig.features.bringup.calibration.joint_procedure import (
    calibrate_by_hand,
    calibrate_by_motion,
)
from gazerig.features.bringup.calibration.linkage_calibration import (
    HandMarker,
    HobbyMarker,
    calibrate_by_marks,
)
from gazerig.features.bringup.calibration.smart_servo_access import SingleJoint, SingleServo
from gazerig.features.bringup.cli.jog_prompt import TerminalJogger
from gazerig.features.bringup.cli.ports import RigPorts, open_port
from gazerig.features.bringup.servo_families import KINDS, kind_of
from gazerig.robot.app.bus_wiring import bus_names, joints_on, release_plan
from gazerig.robot.cli.terminal import say
from gazerig.robot.control.interrupts import Interrupts
from gazerig.robot.control.power_down import PowerDown
from gazerig.robot.guardian.guardian import Guardian
from gazerig.robot.model.clock import RealClock

JointResult = Calibration | LinkageFit


class ActuationMode(StrEnum):
    """Source of the motion of a joint."""

    hand = "hand"
    motion = "motion"


class ZeroReference(StrEnum):
    """Source of the zero after the stops were found by motion."""

    middle = "middle"
    person = "person"


class CalibrationOptions(NamedTuple):
    """Options of a calibration, as on the command line.

    pulses_us: hobby servos are never sent outside
    more: places of a linkage between each two that are marked
    """

    by: ActuationMode
    margin_deg: float
    zero: ZeroReference
    search: StopSearchParams
    clear_offset: bool
    set_middle: bool
    pulses_us: tuple[float, float]
    more: int


class CalibrationJob(NamedTuple):
    """Context of a calibration, without the joints."""

    rig: Rig
    wire: RigPorts
    how: CalibrationOptions
    person: TerminalJogger
    stopped: Callable[[], str | None]


def measure(
    bench: CalibrationJob, names: Sequence[str]
) -> tuple[dict[str, JointResult], tuple[str, ...]]:
    """Calibrate one joint after the other, bus by bus; return results and refused joints.

    Raises:
        SetupError: a port cannot be opened, or there are no answers left.
        CalibrationStopped: the user or the system requested the end.
    """
    found: dict[str, JointResult] = {}
    refused: list[str] = []
    for bus in bus_names(bench.rig):
        for name in (name for name in joints_on(bench.rig, bus) if name in names):
            try:
                found[name] = _calibrate_joint(bench, name, bus)
            except (CalibrationRefused, ServoMissing, ServoFault) as error:
                refused.append(name)
                say(f"refused: {error}")
    # In the order of the rig, whatever the buses are called.
    return {name: found[name] for name in names if name in found}, tuple(refused)


def refuse_impossible(rig: Rig, names: Sequence[str], how: CalibrationOptions) -> None:
    """Refuse what the servos of these joints cannot do.

    Raises:
        SetupError: names the joints, and what can be done.
    """
    without_feedback = [name for name in names if not rig.joints[name].facts.measured]
    if how.by is ActuationMode.motion and len(without_feedback) == len(names):
        raise SetupError(
            f"--by motion: hobby servos do not report their position ({', '.join(without_feedback)}), so no "
            "stop can be found: leave --by away and steer them yourself"
        )
    able = [kind for kind in KINDS.values() if kind.set_middle is not None]
    other = [
        name
        for name in names
        if not rig.joints[name].facts.measured or kind_of(rig.joints[name].model).set_middle is None
    ]
    if how.set_middle and other:
        titles = " and ".join(kind.title for kind in able)
        raise SetupError(
            f"--set-middle: only {titles} servos can be set so, not that of {', '.join(other)}: "
            "choose joints with --joint"
        )
    if how.clear_offset and len(without_feedback) == len(names):
        raise SetupError("--clear-offset: hobby servos have no offset: leave it away")
    low, high = how.pulses_us
    least, most = 500.0, 2500.0
    if not least <= low < high <= most:
        raise SetupError(f"--pulses {low:g}:{high:g}: must ascend within {least:g}:{most:g} us")


def _calibrate_joint(bench: CalibrationJob, name: str, bus: str) -> JointResult:
    if not bench.rig.joints[name].facts.measured:
        return _calibrate_hobby_servo(bench, name, bus)
    guardian = _guardian(bench, name, bus)
    with open_port(bench.rig, bench.wire, bus, guardian) as port:
        joint = bench.rig.joints[name]
        servo = SingleServo(name, joint.id, joint.model, port, guardian)
        single = SingleJoint(name, joint, servo, RealClock(), bench.stopped)
        bench.person.hand = None
        if (buses := bench.wire.buses) is not None:

            def turn(steps: int) -> None:
                buses.command(f"turn {joint.id} {steps}", bus)

            bench.person.hand = turn
        with _torque_off_after(single.who, servo.disable_torque, bench.stopped):
            return _calibrate_smart_servo(bench, single)


def _guardian(bench: CalibrationJob, name: str, bus: str) -> Guardian:
    """Return what switches one joint's servo off if this program dies or hangs."""
    plan = release_plan(bench.rig, bus, bench.wire.paths[bus])
    return Guardian((plan._replace(ids=(bench.rig.joints[name].id,)),))


def _calibrate_smart_servo(bench: CalibrationJob, single: SingleJoint) -> JointResult:
    how, person = bench.how, bench.person
    if how.clear_offset:
        was = single.servo.clear_offset()
        if was:
            say(f"{single.who}: its offset {was} -> 0; {_VOID}")
    single.servo.check()
    if how.set_middle:
        single.servo.disable_torque()
        person.wait(
            f"turn {single.name} to the middle of its travel, then press Enter",
            lambda: f"{single.name}: step {single.position()[0]}",
        )
        say(f"{single.who}: its place is 2048 now (offset {single.servo.set_middle()}); {_VOID}")
    if single.joint.transmission_points:
        if how.by is ActuationMode.motion:
            raise CalibrationRefused(
                f"{single.name}: its push rod has measured places (transmission_points), which motion cannot "
                "find: --by hand"
            )
        return calibrate_by_marks(HandMarker(single, person), person, how.margin_deg, how.more)
    if how.by is ActuationMode.hand:
        return calibrate_by_hand(single, person, how.margin_deg)
    # A heavy head must not move on its own without a confirmation.
    asked = (
        f"{single.name} will move on its own, and sink when the torque goes off: hold the head. "
        "Go on?"
    )
    if "neck" in single.name.split("_") and not person.agrees(asked):
        raise CalibrationRefused(f"{single.name}: left out as you asked")
    return calibrate_by_motion(single, person, how.margin_deg, how.search, how.zero.value)


_VOID = "until this calibration is written the rig file's zero is wrong by that"


def _calibrate_hobby_servo(bench: CalibrationJob, name: str, bus: str) -> JointResult:
    config = bench.rig.bus_named(bus)
    guardian = _guardian(bench, name, bus)
    port = port_of(bench.wire.paths[bus], on_traffic=guardian.beat)
    joint, how, person = bench.rig.joints[name], bench.how, bench.person
    params = config.maestro if config.kind == "maestro" else config.pca9685
    hobby = HobbyServoHandle(
        name, joint, port, params, RealClock(), bench.stopped, how.pulses_us, guardian
    )
    person.hand = None
    with _torque_off_after(hobby.who, hobby.disable, bench.stopped):
        return calibrate_by_marks(HobbyMarker(hobby, person), person, how.margin_deg, how.more)


@contextlib.contextmanager
def _torque_off_after(
    who: str, torque_off: Callable[[], None], stopped: Callable[[], str | None]
) -> Iterator[None]:
    """Switch the torque off however the block ends; nothing is printed if that works."""
    with PowerDown(
        None,
        torque_off,
        lambda line: say(f"{who}: {line}"),
        Interrupts.of(stopped),
        left=": cut the servo power",
        quiet=True,
    ) as way_out:
        way_out.switch_on(lambda: None)  # what follows does it, at a time of its own
        yield
