"""Rules for one servo that compare its registers with the rig's YAML. Nothing is written.

A latched fault stays until a restart. Other error bits last as long as their cause, except
overload and overcurrent, which last until a goal that moves away from the obstacle, or a restart.
Sources: ROBOTIS e-Manual, X series; Feetech memory table STS3215.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

from gazerig.drivers.bus.servo_models import servo_label
from gazerig.drivers.errors import ServoMissing
from gazerig.drivers.serial.port import BusPort
from gazerig.drivers.servo_bus.discovery import FoundServo
from gazerig.drivers.servo_bus.family import ServoModel
from gazerig.drivers.servo_bus.settings import write_settings
from gazerig.drivers.servo_bus.transaction import Transactions
from gazerig.drivers.types import ServoConfig
from gazerig.features.bringup.doctor.diagnostics import Advice, Diagnostic, Fix
from gazerig.features.bringup.doctor.servo_checks import FIX, ServoChecks
from gazerig.features.bringup.servo_kinds import ServoKind

MOST_NAMED = 6
TRIPPED = 255
WARM_C = 10
"""Distance from the temperature limit at which a servo is called warm."""
WEAK = 0.9
"""Fraction of the rated voltage below which a servo has little speed and torque."""
MEANT = 0.875
"""Fraction of a rated voltage above which a supply is intended for servos of that voltage."""

VOLTAGE = "input voltage"
"""Every family's name of an unfit voltage, in bit 0."""

# fmt: off
ADVICE = {
    "well": Advice("ok", "{found.model}, firmware {firmware}, {volts:.1f} V, {present_temperature} "
        "degC, at step {present_position}"),
    "model": Advice("error", "is {found.model}, the YAML says {setup.model}",
        "connect the right servo and run gazerig setup --joint {setup.name}, or correct the model "
        "in the YAML"),
    "collision": Advice("error",
        "its answers come in pieces: two servos share id {setup.id}, or a plug is loose",
        "connect this joint's servo alone and look with gazerig scan; a second one with the same "
        "id gets its own by gazerig setup"),
    "mute": Advice("error", "answers pings and nothing else (Status Return Level 0)", FIX),
    "unread": Advice("error", "gave no good answer about {named}",
        "check its plug and its neighbours' and try again"),
    "latched": Advice("error", "has latched: {error}", "{remedy}; then switch its power off and on"),
    "reported": Advice("error", "reports: {error}", "{remedy}"),
    "voltage": Advice("error", "{limits}{checks.out_of_voltage}", "{remedy}"),
    "weak": Advice("warn", "{limits}; made for {model.rated_v:g} V, it is slow and weak here",
        "measure at the supply and at this servo: thin wires and long chains lose volts"),
    "baud": Advice("warn", "answers at {found.baud} bit/s, but its Baud Rate is {rate}: after its "
        "next start it will not be heard here", "gazerig setup --joint {setup.name}"),
    "far": Advice("error", "{far} No torque is switched on there",
        "look at the joint: if it is there, turn it inside by hand or let gazerig run --recover "
        "move it slowly; if not, correct that cause, then gazerig calibrate --joint {setup.name}"),
    "unlimited": Advice("warn", "has no position limits of its own and many turns", FIX),
    "narrow": Advice("warn",
        "its own position limits {low}..{high} cut the YAML's range {least}..{most}", FIX),
    "wide": Advice("note", "its own position limits {low}..{high} are wider than the YAML's range",
        FIX),
    "latch": Advice("note", "a moment outside {low:.1f}..{high:.1f} V switches its torque off "
        "until it is restarted ({register} {value})", "size the supply for all servos at once, and "
        "feed long chains at both ends; switching the power off and on brings a latched servo back"),
    "overload": Advice("warn", "its overload protection cannot act as meant (Overload Torque "
        "{share} %, Protection Time {seconds:g} s)",
        "set Overload Torque (36) to 80 and Protection Time (35) to 200 with {checks.maker_program}"),
    "slower": Advice("note",
        "its Velocity Limit is {limit:.0f} deg/s, the YAML asks for {asked:.0f}",
        "lower max_speed_deg_s in the YAML or raise the limit with {checks.maker_program}"),
    "slow": Advice("note", "the YAML asks its shaft for {asked:.0f} deg/s; without load and at "
        "{model.rated_v:g} V it turns {limit:.0f}", "lower max_speed_deg_s in the YAML"),
}
# fmt: on
"""Findings that need a function; those with one condition are in ``RULES``."""


@dataclass(frozen=True, slots=True)
class ServoState:
    """State of one servo.

    values: registers by name, None without a valid answer
    shares_id: whether two servos seem to have its id
    far: why no torque would be switched on where its joint is, "" if it would
    """

    checks: ServoChecks
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
        return self.checks.kind.family.models[self.setup.model]

    def finding(self, advice: Advice, *fixes: tuple[str, int], **facts: object) -> Diagnostic:
        """Return a finding about this servo.

        fixes: registers and their correct values
        facts: values for the advice besides ``setup``, ``found``, ``checks``, ``model`` and the
            registers
        """
        made = (Fix(self.setup.id, name, value, self.values.get(name)) for name, value in fixes)
        known = {"setup": self.setup, "found": self.found, "checks": self.checks}
        known |= {"model": self.model, **self.values, **facts}
        return advice.at(servo_label(self.setup), *made, **known)


Rule = Callable[[ServoState], Iterator[Diagnostic]]


@dataclass(frozen=True)
class RegisterRule:
    """``Rule`` with one condition.

    registers: required registers; the rule does not apply if any is missing or was not read
    applies: the condition, called with the servo and their values
    """

    registers: tuple[str, ...]
    applies: Callable[..., bool]
    advice: Advice
    fixes: tuple[tuple[str, int], ...] = ()

    def __call__(self, state: ServoState) -> Iterator[Diagnostic]:
        """Return the finding if it applies."""
        values = [state.values.get(name) for name in self.registers]
        if None not in values and self.applies(state, *values):
            yield state.finding(self.advice, *self.fixes)


def read_state(
    line: Transactions,
    checks: ServoChecks,
    setup: ServoConfig,
    found: FoundServo,
    shares_id: bool,
) -> ServoState:
    """Read all registers of one servo that the rules need.

    Raises:
        BusLost: the port has disappeared.
    """
    values = line.read_many(setup.id, checks.registers)
    return ServoState(checks, setup, found, values, shares_id)


def apply_rules(state: ServoState) -> list[Diagnostic]:
    """Return all faults of one servo; a healthy one has one finding that describes it.

    A servo of another model, or with the id of another servo, is not examined further.
    """
    family, values = state.checks.kind.family, state.values
    findings = []
    if state.found.number != state.model.number:
        findings.append(state.finding(ADVICE["model"]))
    if state.shares_id:
        findings.append(state.finding(ADVICE["collision"]))
    if not findings:
        silent = all(value is None for value in values.values())
        if silent and state.checks.ping_only:
            level = ("status_return_level", family.answer_level)
            findings.append(state.finding(ADVICE["mute"], level))
        else:
            rules: tuple[Rule, ...] = (_unread,) if silent else (_unread, *RULES)
            findings = [finding for rule in rules for finding in rule(state)]
    if not any(finding.level in ("warn", "error") for finding in findings):
        firmware = family.format_firmware(state.found.firmware)
        volts = (values["present_input_voltage"] or 0) / 10.0
        findings.insert(0, state.finding(ADVICE["well"], firmware=firmware, volts=volts))
    return findings


def _unread(state: ServoState) -> Iterator[Diagnostic]:
    names = [name.replace("_", " ") for name, value in state.values.items() if value is None]
    if names:
        named = ", ".join(names) if len(names) <= MOST_NAMED else "its registers"
        yield state.finding(ADVICE["unread"], named=named)


def _errors(state: ServoState) -> Iterator[Diagnostic]:
    family, remedies = state.checks.kind.family, state.checks.error_remedies
    advice = ADVICE["latched" if family.faults_latch else "reported"]
    for error in family.name_errors(state.values[family.error_register] or 0):
        remedy = remedies.get(error, f"look it up in {state.checks.maker_manual}")
        if remedy:
            yield state.finding(advice, error=error, remedy=remedy.format(setup=state.setup))


def _voltage(state: ServoState) -> Iterator[Diagnostic]:
    volts = state.values["present_input_voltage"]
    low, high = state.values["min_voltage_limit"], state.values["max_voltage_limit"]
    if volts is None or low is None or high is None:
        return
    limits = f"{volts / 10.0:.1f} V, its limits are {low / 10.0:.1f}..{high / 10.0:.1f} V"
    if not low <= volts <= high:
        remedy = _too_high(state, volts) if volts > high else ""
        remedy = remedy or "correct the supply before anything moves"
        yield state.finding(ADVICE["voltage"], limits=limits, remedy=remedy)
    elif volts < 10.0 * WEAK * state.model.rated_v:
        yield state.finding(ADVICE["weak"], limits=limits)


def _too_high(state: ServoState, volts: int) -> str:
    """Return the remedy for a model whose versions for other voltages look the same on the bus."""
    model, raised = state.model, "set Max Voltage (14) to {} with " + state.checks.maker_program
    for other in state.checks.kind.family.models.values():
        if other.number != model.number:
            continue
        if other.rated_v > model.rated_v and volts >= 10.0 * MEANT * other.rated_v:
            return (
                f"switch the supply off: the YAML's {model.name} is a servo for "
                f"{model.rated_v:g} V; is it the {other.rated_v:g} V version (see its label), "
                f"write {other.name} into the YAML and {raised.format(other.max_voltage)}"
            )
        if other.rated_v < model.rated_v and volts <= model.max_voltage:
            return (
                f"see its label: a {other.rated_v:g} V servo must come off this supply at once; "
                f"is it the {model.rated_v:g} V version, {raised.format(model.max_voltage)}"
            )
    return ""


def _far_outside(state: ServoState) -> Iterator[Diagnostic]:
    if state.far:
        yield state.finding(ADVICE["far"], far=state.far)


def _firmware(state: ServoState) -> Iterator[Diagnostic]:
    notes = state.checks.firmware_notes(state.setup.model)
    # The first one is used.
    yield from [state.finding(note) for below, note in notes if state.found.firmware < below][:1]


def _baud(state: ServoState) -> Iterator[Diagnostic]:
    value, rates = state.values["baud_rate"], state.checks.kind.family.baud_rates
    if value is not None and value < len(rates) and rates[value] != state.found.baud:
        yield state.finding(ADVICE["baud"], rate=rates[value])


def _wanted(state: ServoState) -> Iterator[Diagnostic]:
    for wanted in state.checks.wanted_settings:
        value = state.values[wanted.register]
        if value is None or wanted.accepts(value):
            continue
        right = value & ~wanted.mask | wanted.value & wanted.mask
        fixes = ((wanted.register, right),) if wanted.remedy == FIX else ()
        advice = Advice(wanted.level, wanted.text(value), wanted.remedy)
        yield state.finding(advice, *fixes)


def _limits(state: ServoState) -> Iterator[Diagnostic]:
    low, high = state.values["min_position_limit"], state.values["max_position_limit"]
    least, most = state.setup.min_steps, state.setup.max_steps
    if state.checks.unlimited_at_zero:
        least, most = max(0, least), max(1, most)
    if low is None or high is None or (low, high) == (least, most):
        return
    if state.checks.unlimited_at_zero and low == high == 0:
        advice = ADVICE["unlimited"]
    else:
        advice = ADVICE["narrow" if low > least or high < most else "wide"]
    fixes = (("min_position_limit", least), ("max_position_limit", most))
    yield state.finding(advice, *fixes, low=low, high=high, least=least, most=most)


def _protection(state: ServoState) -> Iterator[Diagnostic]:
    register, errors, text, by_hand = state.checks.protection
    value = state.values[register]
    off = [error for bit, error in errors.items() if value is not None and not value & bit]
    if value is None or not off:
        return
    fixes = () if by_hand is not None else ((register, value | sum(errors)),)
    advice = Advice("warn", text, FIX if by_hand is None else by_hand(state.setup.model))
    yield state.finding(advice, *fixes, errors=", ".join(off), value=value)


def _voltage_latch(state: ServoState) -> Iterator[Diagnostic]:
    """Note that a short voltage fault is sufficient to switch the torque off."""
    family, register = state.checks.kind.family, state.checks.protection.register
    value = state.values[register]
    if value is None or not family.faults_latch or family.name_errors(value & 1) != (VOLTAGE,):
        return
    low, high = state.values["min_voltage_limit"] or 0, state.values["max_voltage_limit"] or 0
    named = register.capitalize()
    yield state.finding(
        ADVICE["latch"], low=low / 10.0, high=high / 10.0, register=named, value=value
    )


def _overload(state: ServoState) -> Iterator[Diagnostic]:
    """Check that load limit and time of an overload protection both permit it to act."""
    share, after = state.values.get("overload_torque"), state.values.get("protection_time")
    if share is not None and after is not None and (share >= 100 or not after):
        yield state.finding(ADVICE["overload"], share=share, seconds=after / 100.0)


def _speed(state: ServoState) -> Iterator[Diagnostic]:
    """Compare the YAML's speed with the servo's own limit, or with the speed of its motor."""
    family, wanted_steps_s = state.checks.kind.family, state.setup.max_speed_steps_s
    unit_deg_s = family.velocity_unit_steps_s * 360.0 / family.steps_per_turn
    asked = int(wanted_steps_s / family.velocity_unit_steps_s)
    limit, fastest_steps_s = state.values.get("velocity_limit"), state.model.no_load_steps_s
    if limit is not None and limit < asked:
        yield state.finding(ADVICE["slower"], limit=limit * unit_deg_s, asked=asked * unit_deg_s)
    if "velocity_limit" not in state.values and wanted_steps_s > fastest_steps_s:
        turns = fastest_steps_s * 360.0 / family.steps_per_turn
        yield state.finding(ADVICE["slow"], limit=turns, asked=asked * unit_deg_s)


_HOT = "{present_temperature} degC, it switches off above {temperature_limit}"

# fmt: off
RULES: tuple[Rule, ...] = (
    _errors,
    _voltage,
    RegisterRule(("present_temperature", "temperature_limit"), lambda _, warm, limit: warm >= limit,
        Advice("error", _HOT, "let it cool")),
    RegisterRule(("present_temperature", "temperature_limit"),
        lambda _, warm, limit: limit - WARM_C <= warm < limit,
        Advice("warn", _HOT, "let it cool")),
    RegisterRule(("torque_enable",), lambda _, torque: torque != 0,
        Advice("warn",
            "its torque is on though no program runs it; its settings cannot be changed so",
            "hold the joint and switch its power off and on")),
    RegisterRule(("bus_watchdog",), lambda _, watchdog: watchdog == TRIPPED,
        Advice("warn",
            "its bus watchdog has tripped: it refuses goals (a program ended without notice)", FIX),
        (("bus_watchdog", 0),)),
    RegisterRule(("lock",), lambda _, lock: lock == 0,
        Advice("warn",
            "its memory is open (Lock 0): whatever is written to its settings stays for good", FIX),
        (("lock", 1),)),
    _far_outside,
    RegisterRule(("present_position",),
        lambda s, at: not s.far and not s.setup.min_steps <= at <= s.setup.max_steps,
        Advice("warn",
            "is at step {present_position}, outside its range {setup.min_steps}..{setup.max_steps}",
            "turn it inside by hand (torque off); if it is inside already, gazerig calibrate --joint "
            "{setup.name}")),
    _firmware,
    _baud,
    _wanted,
    _limits,
    _protection,
    _voltage_latch,
    _overload,
    _speed,
)
# fmt: on


def apply_fix(port: BusPort, kind: ServoKind, fix: Fix) -> str:
    """Write a fix if the torque is off, so that it persists; return "" or the reason of a failure.

    Raises:
        BusLost: the port has disappeared.
    """
    line, servo_id = Transactions(port, kind.family), fix.servo_id
    torque = line.read(servo_id, "torque_enable")
    if not torque and line.read(servo_id, "status_return_level") != kind.family.answer_level:
        # A servo that answers only queries or pings does not confirm the following writes.
        line.write_all((servo_id,), "status_return_level", [kind.family.answer_level])
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
