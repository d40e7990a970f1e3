"""What is wrong with a servo: registers as read, judged by the rig's YAML. Nothing is written.

Every rule is a function of one ``Patient`` and yields verdicts. Sources: ROBOTIS e-Manual,
X series; the numbers are those of drivers.dynamixel.control_table.
"""

from collections.abc import Iterator

from drivers.serial.port import BusPort
from drivers.servo_bus.discovery import SHARED
from drivers.servo_bus.registers import Registers
from drivers.types import ServoSetup
from robot.bringup.doctor.findings import Finding, Fix
from robot.bringup.doctor.settings import SETTINGS
from robot.bringup.doctor.state import STATE
from robot.bringup.doctor.subject import Patient, Verdict
from robot.bringup.servo_kind import Found

RULES = (*STATE, *SETTINGS)

READ = (
    "status_return_level",
    "torque_enable",
    "hardware_error_status",
    "bus_watchdog",
    "baud_rate",
    "return_delay_time",
    "drive_mode",
    "operating_mode",
    "secondary_id",
    "protocol_type",
    "homing_offset",
    "temperature_limit",
    "max_voltage_limit",
    "min_voltage_limit",
    "velocity_limit",
    "max_position_limit",
    "min_position_limit",
    "startup_configuration",
    "shutdown",
    "present_position",
    "present_input_voltage",
    "present_temperature",
)
"""The registers that are looked at."""


def visit(port: BusPort, setup: ServoSetup, found: Found, garbled: int) -> list[Finding]:
    """Read one servo and judge it; torque is left as it is.

    Raises:
        drivers.errors.BusLost: the port is gone.
    """
    return examine(take(Registers(port), setup, found, garbled))


def take(registers: Registers, setup: ServoSetup, found: Found, garbled: int) -> Patient:
    """Read all that the rules want to know of one servo.

    Raises:
        drivers.errors.BusLost: the port is gone.
    """
    first = registers.read(setup.id, READ[0])
    if first is None:  # answers pings alone: every further question would wait in vain
        return Patient(setup, found, dict.fromkeys(READ), garbled)
    rest = {name: registers.read(setup.id, name) for name in READ[1:]}
    return Patient(setup, found, {READ[0]: first, **rest}, garbled)


def examine(patient: Patient) -> list[Finding]:
    """Judge one servo: all that is wrong; one finding says it where it is well.

    One that is not the right one, or not alone with its id, is not judged further.
    """
    whole: list[Verdict] = [*_identity(patient), *_collision(patient)]
    if not whole:
        silent = patient.values[READ[0]] is None
        rules = (_mute,) if silent else (_unread, *RULES)
        whole = [verdict for rule in rules for verdict in rule(patient)]
    findings = [_finding(patient, verdict) for verdict in whole]
    if not any(finding.level in ("warn", "error") for finding in findings):
        findings.insert(0, Finding("ok", _well(patient), patient.where))
    return findings


def _finding(patient: Patient, verdict: Verdict) -> Finding:
    fixes = tuple(
        Fix(patient.setup.id, name, value, patient.values.get(name))
        for name, value in verdict.fixes
    )
    return Finding(verdict.level, verdict.what, patient.where, verdict.cure, fixes)


def _well(patient: Patient) -> str:
    values, found = patient.values, patient.found
    return (
        f"{found.model}, firmware {found.firmware}, "
        f"{(values['present_input_voltage'] or 0) / 10.0:.1f} V, "
        f"{values['present_temperature']} degC, at step {values['present_position']}"
    )


def _identity(patient: Patient) -> Iterator[Verdict]:
    found, wanted = patient.found, patient.setup.model
    if found.number != patient.model.number:
        yield Verdict(
            "error",
            f"is {found.model}, the YAML says {wanted}",
            f"connect the right servo and run gazerig setup --joint {patient.setup.name}, "
            "or correct the model in the YAML",
        )


def _collision(patient: Patient) -> Iterator[Verdict]:
    if patient.garbled >= SHARED:
        yield Verdict(
            "error",
            f"{patient.garbled} of 6 answers came in pieces: two servos share id "
            f"{patient.setup.id}, or a plug is loose",
            "connect this joint's servo alone and look with gazerig scan; a second one with "
            "the same id gets its own by gazerig setup",
        )


def _mute(patient: Patient) -> Iterator[Verdict]:
    yield Verdict(
        "error",
        "answers pings and nothing else (Status Return Level 0)",
        "gazerig doctor --fix",
        (("status_return_level", 2),),
    )


def _unread(patient: Patient) -> Iterator[Verdict]:
    names = [name.replace("_", " ") for name, value in patient.values.items() if value is None]
    if names:
        yield Verdict(
            "error",
            f"gave no good answer about {', '.join(names)}",
            "check its plug and its neighbours' and try again",
        )
