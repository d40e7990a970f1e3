"""What is wrong with an STS servo: registers as read, judged by the rig's YAML.

Nothing is written. Every rule is a function of one ``StsPatient`` and yields verdicts.
Sources: Feetech, memory table STS3215; the numbers are those of drivers.feetech.memory_table.
"""

from collections.abc import Iterator

from drivers.feetech.memory_table import EEPROM_END, REGISTERS
from drivers.feetech.registers import StsRegisters
from drivers.feetech.scan import SHARED
from drivers.serial.port import BusPort
from drivers.types import ServoSetup
from robot.bringup.doctor.feetech_settings import SETTINGS
from robot.bringup.doctor.feetech_state import STATE
from robot.bringup.doctor.feetech_subject import StsPatient, StsRule
from robot.bringup.doctor.findings import Finding, Fix
from robot.bringup.doctor.subject import Verdict
from robot.bringup.servo_kind import Found

RULES: tuple[StsRule, ...] = (*STATE, *SETTINGS)

SPANS = ((0, EEPROM_END), (EEPROM_END, 71 - EEPROM_END))
"""First address and length of what is read at once: all that is kept, and all that lives."""


def visit(port: BusPort, setup: ServoSetup, found: Found, garbled: int) -> list[Finding]:
    """Read one servo and judge it; torque is left as it is.

    Raises:
        drivers.errors.BusLost: the port is gone.
    """
    return examine(take(StsRegisters(port), setup, found, garbled))


def take(registers: StsRegisters, setup: ServoSetup, found: Found, garbled: int) -> StsPatient:
    """Read all that the rules want to know of one servo.

    Raises:
        drivers.errors.BusLost: the port is gone.
    """
    values: dict[str, int] = {}
    for first, length in SPANS:
        data = registers.read_bytes(setup.id, first, length)
        if data is None:
            continue
        for name, register in REGISTERS.items():
            at = register.address - first
            if at >= 0 and at + register.size <= length:
                values[name] = register.decode(data[at : at + register.size])
    return StsPatient(setup, found, values, garbled)


def examine(patient: StsPatient) -> list[Finding]:
    """Judge one servo: all that is wrong; one finding says it where it is well.

    One that is not the right one, or not alone with its id, is not judged further.
    """
    whole: list[Verdict] = [*_identity(patient), *_collision(patient)]
    if not whole:
        rules = RULES if patient.whole else (_unread,)
        whole = [verdict for rule in rules for verdict in rule(patient)]
    findings = [_finding(patient, verdict) for verdict in whole]
    if not any(finding.level in ("warn", "error") for finding in findings):
        findings.insert(0, Finding("ok", _well(patient), patient.where))
    return findings


def _finding(patient: StsPatient, verdict: Verdict) -> Finding:
    fixes = tuple(
        Fix(patient.setup.id, name, value, patient.values.get(name))
        for name, value in verdict.fixes
    )
    return Finding(verdict.level, verdict.what, patient.where, verdict.cure, fixes)


def _well(patient: StsPatient) -> str:
    values, firmware = patient.values, patient.found.firmware
    return (
        f"{patient.found.model}, firmware {firmware // 100}.{firmware % 100}, "
        f"{values['present_input_voltage'] / 10.0:.1f} V, "
        f"{values['present_temperature']} degC, at step {values['present_position']}"
    )


def _identity(patient: StsPatient) -> Iterator[Verdict]:
    if patient.found.number != patient.model.number:
        yield Verdict(
            "error",
            f"is {patient.found.model}, the YAML says {patient.setup.model}",
            f"connect the right servo and run gazerig setup --joint {patient.setup.name}, "
            "or correct the model in the YAML",
        )


def _collision(patient: StsPatient) -> Iterator[Verdict]:
    if patient.garbled >= SHARED:
        yield Verdict(
            "error",
            f"{patient.garbled} of 6 answers came in pieces: two servos share id "
            f"{patient.setup.id}, or a plug is loose",
            "connect this joint's servo alone and look with gazerig scan; a second one with "
            "the same id gets its own by gazerig setup",
        )


def _unread(patient: StsPatient) -> Iterator[Verdict]:
    yield Verdict(
        "error",
        "gave no good answer about its registers",
        "check its plug and its neighbours' and try again",
    )
