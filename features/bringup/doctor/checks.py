"""What is wrong with a servo: registers as read, judged by the rig's YAML. Nothing is written.

Every rule is a function of one ``ServoState`` and yields verdicts.
"""

from collections.abc import Iterator

from gazerig.drivers.serial.port import BusPort
from gazerig.drivers.servo_bus.discovery import SHARED, FoundServo
from gazerig.drivers.servo_bus.registers import Registers
from gazerig.drivers.types import ServoConfig
from gazerig.features.bringup.doctor.diagnostics import Diagnostic, Fix
from gazerig.features.bringup.doctor.families import CHECKS
from gazerig.features.bringup.doctor.settings import SETTINGS
from gazerig.features.bringup.doctor.state import STATE
from gazerig.features.bringup.doctor.subject import FIX, RuleResult, ServoChecks, ServoState
from gazerig.features.bringup.servo_family import ServoKind

MOST_NAMED = 6


def visit(
    port: BusPort, kind: ServoKind, setup: ServoConfig, found: FoundServo, corrupt: int
) -> list[Diagnostic]:
    """Read one servo and judge it; torque is left as it is.

    Raises:
        BusLost: the port is gone.
    """
    return examine(
        take(Registers(port, kind.family), CHECKS[kind.family.name], setup, found, corrupt)
    )


def take(
    registers: Registers, checks: ServoChecks, setup: ServoConfig, found: FoundServo, corrupt: int
) -> ServoState:
    """Read all that the rules want to know of one servo.

    Raises:
        BusLost: the port is gone.
    """
    return ServoState(
        checks, setup, found, registers.read_many(setup.id, checks.registers), corrupt
    )


def examine(state: ServoState) -> list[Diagnostic]:
    """Judge one servo: all that is wrong; one finding says it where it is well.

    One that is not the right one, or not alone with its id, is not judged further.
    """
    whole: list[RuleResult] = [*_identity(state), *_collision(state)]
    if not whole:
        rules = (_mute,) if state.silent else (_unread, *STATE, *SETTINGS)
        whole = [verdict for rule in rules for verdict in rule(state)]
    findings = [_finding(state, verdict) for verdict in whole]
    if not any(finding.level in ("warn", "error") for finding in findings):
        findings.insert(0, Diagnostic("ok", _well(state), state.where))
    return findings


def _finding(state: ServoState, verdict: RuleResult) -> Diagnostic:
    fixes = tuple(
        Fix(state.setup.id, name, value, state.values.get(name)) for name, value in verdict.fixes
    )
    return Diagnostic(verdict.level, verdict.what, state.where, verdict.remedy, fixes)


def _well(state: ServoState) -> str:
    values, found = state.values, state.found
    return (
        f"{found.model}, firmware {state.checks.kind.family.version(found.firmware)}, "
        f"{(values['present_input_voltage'] or 0) / 10.0:.1f} V, "
        f"{values['present_temperature']} degC, at step {values['present_position']}"
    )


def _identity(state: ServoState) -> Iterator[RuleResult]:
    if state.found.number != state.model.number:
        yield RuleResult(
            "error",
            f"is {state.found.model}, the YAML says {state.setup.model}",
            f"connect the right servo and run gazerig setup --joint {state.setup.name}, "
            "or correct the model in the YAML",
        )


def _collision(state: ServoState) -> Iterator[RuleResult]:
    if state.corrupt >= SHARED:
        yield RuleResult(
            "error",
            f"{state.corrupt} of 6 answers came in pieces: two servos share id "
            f"{state.setup.id}, or a plug is loose",
            "connect this joint's servo alone and look with gazerig scan; a second one with "
            "the same id gets its own by gazerig setup",
        )


def _mute(state: ServoState) -> Iterator[RuleResult]:
    if state.checks.ping_only:
        yield RuleResult(
            "error",
            "answers pings and nothing else (Status Return Level 0)",
            FIX,
            (("status_return_level", state.checks.kind.family.answer_level),),
        )
    else:
        yield from _unread(state)


def _unread(state: ServoState) -> Iterator[RuleResult]:
    names = [name.replace("_", " ") for name, value in state.values.items() if value is None]
    if names:
        named = ", ".join(names) if len(names) <= MOST_NAMED else "its registers"
        yield RuleResult(
            "error",
            f"gave no good answer about {named}",
            "check its plug and its neighbours' and try again",
        )


# --- mending


def apply_fix(port: BusPort, kind: ServoKind, fix: Fix) -> str:
    """Write a fix where the torque is off, so that it stays; return "" or why it was not done.

    Raises:
        BusLost: the port is gone.
    """
    registers, servo_id = Registers(port, kind.family), fix.servo_id
    torque = registers.read(servo_id, "torque_enable")
    if not torque and registers.read(servo_id, "status_return_level") != kind.family.answer_level:
        # A servo that answers questions or pings alone confirms nothing of what follows.
        registers.write_all((servo_id,), "status_return_level", kind.family.answer_level)
        torque = registers.read(servo_id, "torque_enable")
    if torque:
        return "its torque is on"
    if torque is None:
        return "the servo does not take it" if registers.refusal else "the servo does not answer"
    if not registers.write_lasting(servo_id, fix.register, fix.value):
        return "the servo does not take it"
    if registers.read(servo_id, fix.register) != fix.value:
        return "it reads back otherwise"
    return ""
