"""How a servo is now: its errors, supply, heat, torque and position, and what guards it.

Where faults latch they stay until a restart. Elsewhere a bit stands as long as its cause, but
for overload and overcurrent, which stand until a goal that leads away from what holds the
joint, or a restart. Sources: ROBOTIS e-Manual, X series; Feetech memory table STS3215.
"""

from collections.abc import Iterator

from gazerig.drivers.servo_bus.family import Model
from gazerig.features.bringup.doctor.diagnostics import Level
from gazerig.features.bringup.doctor.subject import FIX, Rule, RuleResult, ServoState

TRIPPED = 255
WARM_C = 10
"""So near to its limit a servo is called warm."""
WEAK = 0.9
"""Below this share of the rated voltage a servo has little speed and torque left."""
MEANT = 0.875
"""From this share of a rated voltage on a supply is meant for servos made for that."""


def _errors(state: ServoState) -> Iterator[RuleResult]:
    kind = state.checks.kind
    verb = "has latched" if kind.family.faults_latch else "reports"
    for error in kind.family.name_errors(state.values[kind.family.error_register] or 0):
        look = f"look it up in {state.checks.manual}"
        remedy = state.checks.error_remedies.get(error, look)
        if not remedy:
            continue
        if kind.family.faults_latch:
            remedy += "; then gazerig reboot {id}"
        yield RuleResult("error", f"{verb}: {error}", remedy.format(id=state.setup.id))


def _voltage(state: ServoState) -> Iterator[RuleResult]:
    volts = state.values["present_input_voltage"]
    low, high = state.values["min_voltage_limit"], state.values["max_voltage_limit"]
    if volts is None or low is None or high is None:
        return
    text = f"{volts / 10.0:.1f} V, its limits are {low / 10.0:.1f}..{high / 10.0:.1f} V"
    if not low <= volts <= high:
        remedy = _too_high(state, volts) if volts > high else ""
        yield RuleResult(
            "error",
            f"{text}{state.checks.out_of_voltage}",
            remedy or "correct the supply before anything moves",
        )
    elif volts < 10.0 * WEAK * state.model.rated_v:
        yield RuleResult(
            "warn",
            f"{text}; made for {state.model.rated_v:g} V, it is slow and weak here",
            "measure at the supply and at this servo: thin wires and long chains lose volts",
        )


def _too_high(state: ServoState, volts: int) -> str:
    """Return what to do where a model's versions for other voltages look the same to the bus."""
    model, program = state.model, state.checks.program
    versions = [
        one
        for one in state.checks.kind.family.models.values()
        if one.number == model.number and one.rated_v != model.rated_v
    ]
    for other in versions:
        if other.rated_v > model.rated_v and volts >= 10.0 * MEANT * other.rated_v:
            return (
                f"switch the supply off: the YAML's {model.name} is a servo for "
                f"{model.rated_v:g} V; is it the {other.rated_v:g} V version (see its label), "
                f"write {other.name} into the YAML and {_raise_limit(other, program)}"
            )
        if other.rated_v < model.rated_v and volts <= model.max_voltage:
            return (
                f"see its label: a {other.rated_v:g} V servo must come off this supply at once; "
                f"is it the {model.rated_v:g} V version, {_raise_limit(model, program)}"
            )
    return ""


def _raise_limit(model: Model, program: str) -> str:
    return f"set Max Voltage (14) to {model.max_voltage} with {program}"


def _temperature(state: ServoState) -> Iterator[RuleResult]:
    warm, limit = state.values["present_temperature"], state.values["temperature_limit"]
    if warm is None or limit is None or warm < limit - WARM_C:
        return
    level: Level = "error" if warm >= limit else "warn"
    yield RuleResult(level, f"{warm} degC, it switches off above {limit}", "let it cool")


def _torque(state: ServoState) -> Iterator[RuleResult]:
    if state.values["torque_enable"]:
        yield RuleResult(
            "warn",
            "its torque is on though no program runs it; its settings cannot be changed so",
            f"hold the joint, its torque goes off: gazerig reboot {state.setup.id}",
        )


def _watchdog(state: ServoState) -> Iterator[RuleResult]:
    if state.checks.kind.family.watchdog_unit_s is None:
        return
    if state.values["bus_watchdog"] == TRIPPED:
        yield RuleResult(
            "warn",
            "its bus watchdog has tripped: it refuses goals (a program ended without notice)",
            FIX,
            (("bus_watchdog", 0),),
        )


def _lock(state: ServoState) -> Iterator[RuleResult]:
    lock = state.checks.kind.family.lock
    if lock is not None and state.values[lock] == 0:
        yield RuleResult(
            "warn",
            "its memory is open (Lock 0): whatever is written to its settings stays for good",
            FIX,
            ((lock, 1),),
        )


def _position(state: ServoState) -> Iterator[RuleResult]:
    setup, position = state.setup, state.values["present_position"]
    if position is None or setup.min_steps <= position <= setup.max_steps:
        return
    yield RuleResult(
        "warn",
        f"stands at step {position}, outside its range {setup.min_steps}..{setup.max_steps}",
        "turn it inside by hand (torque off); if it is inside already, gazerig calibrate "
        f"--joint {setup.name}",
    )


STATE: tuple[Rule, ...] = (_errors, _voltage, _temperature, _torque, _watchdog, _lock, _position)
