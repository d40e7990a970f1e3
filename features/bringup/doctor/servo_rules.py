"""Rules for one servo that compare its registers with the rig's YAML. Nothing is written.

A latched fault stays until a restart. Other error bits last as long as their cause, except
overload and overcurrent, which last until a goal that moves away from the obstacle, or a restart.
Sources: ROBOTIS e-Manual, X series; Feetech memory table STS3215.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping

import msgspec

from gazerig.drivers.bus.servo_models import servo_label
from gazerig.drivers.errors import ServoMissing
from gazerig.drivers.servo_bus.discovery import FoundServo
from gazerig.drivers.servo_bus.family import ServoModel
from gazerig.drivers.servo_bus.settings import write_settings
from gazerig.drivers.servo_bus.transaction import Transactions
from gazerig.drivers.types import ServoConfig
from gazerig.features.bringup.doctor.diagnostics import (
    ADVICE,
    FIX,
    Advice,
    Diagnostic,
    FamilyAdvice,
    Fix,
    Setting,
    has_fault,
)
from gazerig.features.bringup.servo_kinds import ServoKind

MOST_NAMED = 6
WARM_C = 10
"""Distance from the temperature limit at which a servo is called warm."""
WEAK = 0.9
"""Fraction of the rated voltage below which a servo has little speed and torque."""
MEANT = 0.875
"""Fraction of a rated voltage above which a supply is intended for servos of that voltage."""


class ServoState(msgspec.Struct, frozen=True):
    """State of one servo.

    values: registers by name, None without a valid answer
    shares_id: whether two servos seem to have its id
    far: why no torque would be switched on where its joint is, "" if it would
    """

    kind: ServoKind
    setup: ServoConfig
    found: FoundServo
    values: Mapping[str, int | None]
    shares_id: bool = False
    far: str = ""

    @property
    def position(self) -> int | None:
        """Return its position, None if it was not read."""
        return self.values.get("present_position")

    @property
    def model(self) -> ServoModel:
        """Return the expected model."""
        return self.kind.family.models[self.setup.model]

    @property
    def advice(self) -> FamilyAdvice:
        """Return the advice for its family."""
        return ADVICE.families[self.kind.family.name]

    def finding(self, advice: Advice, *fixes: tuple[str, int], **facts: object) -> Diagnostic:
        """Return a finding about this servo.

        fixes: registers and their correct values
        facts: further values for the texts
        """
        made = (Fix(self.setup.id, name, value, self.values.get(name)) for name, value in fixes)
        known = {"setup": self.setup, "found": self.found, "model": self.model}
        known |= {"program": self.advice.program, **self.values, **facts}
        return advice.at(servo_label(self.setup), *made, **known)

    def named(self, name: str, *fixes: tuple[str, int], **facts: object) -> Diagnostic:
        """Return a finding of the table; see ``finding``."""
        return self.finding(ADVICE.servos[name], *fixes, **facts)


def read_state(
    line: Transactions, kind: ServoKind, setup: ServoConfig, found: FoundServo, shares_id: bool
) -> ServoState:
    """Read all registers of one servo that the rules need.

    Raises:
        BusLost: the port has disappeared.
    """
    names = (*ADVICE.registers, *ADVICE.families[kind.family.name].registers)
    values = line.read_many(setup.id, [name for name in names if name in kind.family.registers])
    return ServoState(kind, setup, found, values, shares_id)


def apply_rules(state: ServoState) -> list[Diagnostic]:
    """Return all faults of one servo; a healthy one has one finding that describes it.

    A servo of another model, or with the id of another servo, is not examined further.
    """
    family, values = state.kind.family, state.values
    findings = []
    if state.found.number != state.model.number:
        findings.append(state.named("model"))
    if state.shares_id:
        findings.append(state.named("collision"))
    if not findings:
        findings = [finding for rule in RULES for finding in rule(state)]
        if all(value is None for value in values.values()):
            findings = findings[:1]
            if family.watchdog_unit_s is not None:  # a Dynamixel at level 0 answers pings only
                findings = [state.named("mute", ("status_return_level", 2))]
    if not has_fault(findings):
        firmware = family.format_firmware(state.found.firmware)
        volts = (values["present_input_voltage"] or 0) / 10.0
        findings.insert(0, state.named("well", firmware=firmware, volts=volts))
    return findings


def find_obstacles(state: ServoState) -> list[Diagnostic]:
    """Return the faults with which a joint is not calibrated."""
    blocking = [rule for rule in state.advice.settings if rule.blocks]
    errors = [finding for finding in apply_rules(state) if finding.level == "error"]
    return [*errors, *_check(state, blocking)]


def _unread(state: ServoState) -> Iterator[Diagnostic]:
    names = [name.replace("_", " ") for name, value in state.values.items() if value is None]
    if names:
        named = ", ".join(names) if len(names) <= MOST_NAMED else "its registers"
        yield state.named("unread", named=named)


def _errors(state: ServoState) -> Iterator[Diagnostic]:
    family, advice = state.kind.family, state.advice
    for error in family.name_errors(state.values[family.error_register] or 0):
        remedy = advice.errors.get(error, f"look it up in {advice.manual}")
        if remedy:
            name = "latched" if family.faults_latch else "reported"
            yield state.named(name, error=error, remedy=remedy)


def _voltage(state: ServoState) -> Iterator[Diagnostic]:
    """Compare the supply with the limits; versions for other voltages look alike on the bus."""
    volts = state.values["present_input_voltage"]
    low, high = state.values["min_voltage_limit"], state.values["max_voltage_limit"]
    if volts is None or low is None or high is None:
        return
    limits = f"{volts / 10.0:.1f} V, its limits are {low / 10.0:.1f}..{high / 10.0:.1f} V"
    model, name, other = state.model, "voltage", state.model
    if low <= volts <= high:
        if volts < 10.0 * WEAK * model.rated_v:
            yield state.named("weak", limits=limits)
        return
    for alike in state.kind.family.models.values():
        if volts > high and alike.number == model.number:
            if alike.rated_v > model.rated_v and volts >= 10.0 * MEANT * alike.rated_v:
                name, other = "too high", alike
            elif alike.rated_v < model.rated_v and volts <= model.max_voltage:
                name, other = "too low rated", alike
    complaint = state.advice.out_of_voltage
    yield state.named(name, limits=limits, other=other, out_of_voltage=complaint)


def _temperature(state: ServoState) -> Iterator[Diagnostic]:
    warm, limit = state.values["present_temperature"], state.values["temperature_limit"]
    if warm is not None and limit is not None and warm >= limit - WARM_C:
        yield state.named("hot" if warm >= limit else "warm")


def _torque(state: ServoState) -> Iterator[Diagnostic]:
    if state.values["torque_enable"]:
        yield state.named("torque")


def _place(state: ServoState) -> Iterator[Diagnostic]:
    at, setup = state.position, state.setup
    if state.far:
        yield state.named("far", far=state.far)
    elif at is not None and not setup.min_steps <= at <= setup.max_steps:
        yield state.named("outside")


def _baud(state: ServoState) -> Iterator[Diagnostic]:
    value, rates = state.values["baud_rate"], state.kind.family.baud_rates
    if value is not None and value < len(rates) and rates[value] != state.found.baud:
        yield state.named("baud", rate=rates[value])


def _settings(state: ServoState) -> Iterator[Diagnostic]:
    yield from _check(state, state.advice.settings)


def _check(state: ServoState, settings: Iterable[Setting]) -> Iterator[Diagnostic]:
    low, high = state.values["min_voltage_limit"] or 0, state.values["max_voltage_limit"] or 0
    for wanted in settings:
        value = state.values.get(wanted.register)
        if value is None or wanted.accepts(value):
            continue
        facts = {"value": value, "scaled": value * wanted.unit, "low": low / 10, "high": high / 10}
        if wanted.fix:
            right = value & ~wanted.mask | wanted.value & wanted.mask
            repaired = msgspec.structs.replace(wanted, remedy=FIX)
            yield state.finding(repaired, (wanted.register, right), **facts)
        else:
            yield state.finding(wanted, **facts)


def _limits(state: ServoState) -> Iterator[Diagnostic]:
    low, high = state.values["min_position_limit"], state.values["max_position_limit"]
    least, most = state.setup.min_steps, state.setup.max_steps
    # A servo without a watchdog is a Feetech one: both limits 0 mean no limits.
    zero_is_none = state.kind.family.watchdog_unit_s is None
    if zero_is_none:
        least, most = max(0, least), max(1, most)
    if low is None or high is None or (low, high) == (least, most):
        return
    name = "narrow" if low > least or high < most else "wide"
    if zero_is_none and low == high == 0:
        name = "unlimited"
    fixes = (("min_position_limit", least), ("max_position_limit", most))
    yield state.named(name, *fixes, least=least, most=most)


def _speed(state: ServoState) -> Iterator[Diagnostic]:
    """Compare the YAML's speed with the servo's own limit, or with the speed of its motor."""
    family, wanted_steps_s = state.kind.family, state.setup.max_speed_steps_s
    deg = 360.0 / family.steps_per_turn
    unit, fastest_steps_s = family.velocity_unit_steps_s, state.model.no_load_steps_s
    asked = int(wanted_steps_s / unit)
    if "velocity_limit" not in state.values:
        if wanted_steps_s > fastest_steps_s:
            yield state.named("slow", limit=fastest_steps_s * deg, asked=asked * unit * deg)
        return
    limit = state.values["velocity_limit"]
    if limit is not None and limit < asked:
        yield state.named("slower", limit=limit * unit * deg, asked=asked * unit * deg)


RULES: tuple[Callable[[ServoState], Iterator[Diagnostic]], ...] = (
    _unread,
    _errors,
    _voltage,
    _temperature,
    _torque,
    _place,
    _baud,
    _settings,
    _limits,
    _speed,
)


def apply_fix(line: Transactions, fix: Fix) -> str:
    """Write a fix if the torque is off, so that it persists; return "" or the reason why not.

    Raises:
        BusLost: the port has disappeared.
    """
    servo_id, level = fix.servo_id, line.family.answer_level
    torque = line.read(servo_id, "torque_enable")
    if not torque and line.read(servo_id, "status_return_level") != level:
        # A servo that answers only queries or pings does not confirm the following writes.
        line.write_all((servo_id,), "status_return_level", [level])
        torque = line.read(servo_id, "torque_enable")
    if torque:
        return "its torque is on"
    if torque is None:
        return "the servo does not take it" if line.refusal else "the servo does not answer"
    try:
        write_settings(line, servo_id, {fix.register: fix.value})
    except ServoMissing:
        return "the servo does not take it"
    return ""
