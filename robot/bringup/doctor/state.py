"""How a servo is now: what it has latched, its supply, heat, torque and place.

Source: ROBOTIS e-Manual, X series.
"""

from collections.abc import Iterator

from drivers.dynamixel.control_table import name_errors
from robot.bringup.doctor.findings import Level
from robot.bringup.doctor.subject import Patient, Rule, Verdict

TRIPPED = 255
WARM_C = 10
"""So near to its limit a servo is called warm."""
WEAK = 0.9
"""Below this share of the rated voltage a servo has little speed and torque left."""

CURES = {
    "input voltage": "measure the supply at the last servo under load; keep it inside the limits",
    "overheating": "let it cool for 20 minutes and find what makes it work so hard",
    "encoder": "replace the servo if it comes again",
    "electrical shock": "check plugs and wires for shorts; the supply may be too weak",
    "overload": "free the joint: something holds it or its range is too wide",
}


def _latched(patient: Patient) -> Iterator[Verdict]:
    status = patient.values["hardware_error_status"]
    for error in name_errors(status or 0):
        cure = CURES.get(error, "look it up in the e-Manual")
        yield Verdict(
            "error", f"has latched: {error}", f"{cure}; then gazerig reboot {patient.setup.id}"
        )


def _voltage(patient: Patient) -> Iterator[Verdict]:
    volts = patient.values["present_input_voltage"]
    low, high = patient.values["min_voltage_limit"], patient.values["max_voltage_limit"]
    if volts is None or low is None or high is None:
        return
    says = f"{volts / 10.0:.1f} V, its limits are {low / 10.0:.1f}..{high / 10.0:.1f} V"
    if not low <= volts <= high:
        yield Verdict("error", says, "correct the supply before anything moves")
    elif volts < 10.0 * WEAK * patient.model.rated_v:
        yield Verdict(
            "warn",
            f"{says}; made for {patient.model.rated_v:g} V, it is slow and weak here",
            "measure at the supply and at this servo: thin wires and long chains lose volts",
        )


def _temperature(patient: Patient) -> Iterator[Verdict]:
    warm, limit = patient.values["present_temperature"], patient.values["temperature_limit"]
    if warm is None or limit is None or warm < limit - WARM_C:
        return
    level: Level = "error" if warm >= limit else "warn"
    yield Verdict(level, f"{warm} degC, it switches off above {limit}", "let it cool")


def _torque(patient: Patient) -> Iterator[Verdict]:
    if patient.values["torque_enable"]:
        yield Verdict(
            "warn",
            "its torque is on though no program runs it; its settings cannot be changed so",
            f"hold the joint, it goes limp: gazerig reboot {patient.setup.id}",
        )


def _watchdog(patient: Patient) -> Iterator[Verdict]:
    if patient.values["bus_watchdog"] == TRIPPED:
        yield Verdict(
            "warn",
            "its bus watchdog has tripped: it refuses goals (a program ended without notice)",
            "gazerig doctor --fix",
            (("bus_watchdog", 0),),
        )


def _place(patient: Patient) -> Iterator[Verdict]:
    setup, position = patient.setup, patient.values["present_position"]
    if position is None or setup.min_steps <= position <= setup.max_steps:
        return
    yield Verdict(
        "warn",
        f"stands at step {position}, outside its range {setup.min_steps}..{setup.max_steps}",
        "turn it inside by hand (torque off); if it is inside already, gazerig calibrate "
        f"--joint {setup.name}",
    )


STATE: tuple[Rule, ...] = (_latched, _voltage, _temperature, _torque, _watchdog, _place)
