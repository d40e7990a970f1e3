"""How an STS servo is now: what it complains of, its supply, heat, torque, lock and place.

Nothing latches: a bit of Status stands as long as its cause, but for overload and
overcurrent, which stand until a goal that leads away from what holds the joint, or a restart.
Source: Feetech, memory table STS3215, registers 13..15, 19, 34..36, 40, 55, 62, 63, 65.
"""

from collections.abc import Iterator

from drivers.feetech.memory_table import name_errors
from robot.bringup.doctor.feetech_subject import StsPatient, StsRule
from robot.bringup.doctor.findings import Level
from robot.bringup.doctor.subject import Verdict

WARM_C = 10
"""So near to its limit a servo is called warm."""
WEAK = 0.9
"""Below this share of the rated voltage a servo has little speed and torque left."""
TWELVE_V = 105
"""From here on, in 0.1 V, the supply is meant for 12 V servos."""

CURES = {
    "encoder": "its angle sensor fails: replace the servo if it comes again",
    "overheating": "let it cool for 20 minutes and find what makes it work so hard",
    "overcurrent": "free the joint and check plugs and wires for shorts; gazerig reboot {id} ends "
    "it",
    "overload": "free the joint: something holds it or its range is too wide; gazerig reboot {id} "
    "ends it",
}
"""What helps, by the error; the voltage has a verdict of its own."""


def _errors(patient: StsPatient) -> Iterator[Verdict]:
    for error in name_errors(patient.values["status"]):
        if error != "input voltage":
            cure = CURES.get(error, "look it up in Feetech's manual")
            yield Verdict("error", f"reports: {error}", cure.format(id=patient.setup.id))


def _voltage(patient: StsPatient) -> Iterator[Verdict]:
    values = patient.values
    volts = values["present_input_voltage"]
    low, high = values["min_voltage_limit"], values["max_voltage_limit"]
    says = f"{volts / 10.0:.1f} V, its limits are {low / 10.0:.1f}..{high / 10.0:.1f} V"
    if volts > high:
        yield Verdict("error", f"{says}: it complains in every answer", _too_high(patient))
    elif volts < low:
        yield Verdict(
            "error", f"{says}: it complains in every answer", "correct the supply before use"
        )
    elif volts < 10.0 * WEAK * patient.model.rated_v:
        yield Verdict(
            "warn",
            f"{says}; made for {patient.model.rated_v:g} V, it is slow and weak here",
            "measure at the supply and at this servo: thin wires and long chains lose volts",
        )


def _too_high(patient: StsPatient) -> str:
    """Say what to do about a supply that is above a servo's limit."""
    volts, made_for = patient.values["present_input_voltage"], patient.model
    if made_for.rated_v < TWELVE_V / 10.0 <= volts / 10.0:
        return (
            f"switch the supply off: the YAML's {made_for.name} is a servo for "
            f"{made_for.rated_v:g} V; is it the 12 V version (see its label), write sts3215-12v "
            "into the YAML and set Max Voltage (14) to 140 with Feetech's program"
        )
    if volts <= made_for.max_voltage:
        return (
            "see its label: a 7.4 V servo must come off this supply at once; is it the "
            f"{made_for.rated_v:g} V version, set Max Voltage (14) to {made_for.max_voltage} with "
            "Feetech's program"
        )
    return "correct the supply before anything moves"


def _temperature(patient: StsPatient) -> Iterator[Verdict]:
    warm, limit = patient.values["present_temperature"], patient.values["temperature_limit"]
    if warm >= limit - WARM_C:
        level: Level = "error" if warm >= limit else "warn"
        yield Verdict(level, f"{warm} degC, it switches off above {limit}", "let it cool")


def _torque(patient: StsPatient) -> Iterator[Verdict]:
    if patient.values["torque_enable"]:
        yield Verdict(
            "warn",
            "its torque is on though no program runs it; its settings cannot be changed so",
            f"hold the joint, it goes limp: gazerig reboot {patient.setup.id}",
        )


def _lock(patient: StsPatient) -> Iterator[Verdict]:
    if not patient.values["lock"]:
        yield Verdict(
            "warn",
            "its memory is open (Lock 0): whatever is written to its settings stays for good",
            "gazerig doctor --fix",
            (("lock", 1),),
        )


def _place(patient: StsPatient) -> Iterator[Verdict]:
    setup, position = patient.setup, patient.values["present_position"]
    if not setup.min_steps <= position <= setup.max_steps:
        yield Verdict(
            "warn",
            f"stands at step {position}, outside its range {setup.min_steps}..{setup.max_steps}",
            "turn it inside by hand (torque off); if it is inside already, gazerig calibrate "
            f"--joint {setup.name}",
        )


STATE: tuple[StsRule, ...] = (_errors, _voltage, _temperature, _torque, _lock, _place)
