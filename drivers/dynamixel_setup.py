"""Finding the servos of a bus and preparing them, one register at a time.

EEPROM registers are written only where they differ: they wear out, and a write to them
needs the torque off.
"""

from collections.abc import Sequence

from drivers.dynamixel_registers import Registers
from drivers.dynamixel_table import MODELS, VELOCITY_UNIT_STEPS_S
from drivers.errors import ServoMissing
from drivers.types import ServoSetup

NAMES = {model.number: model.name for model in MODELS.values()}

WANTED = (
    ("torque_enable", 0),
    ("bus_watchdog", 0),
    ("return_delay_time", 0),
    ("drive_mode", 0),
    ("operating_mode", 3),
    ("profile_acceleration", 0),
)
"""In this order: EEPROM opens with the torque off, a mode change clears the profile."""


def find(registers: Registers, setups: Sequence[ServoSetup], where: str) -> dict[int, int]:
    """Find every servo and check its model; gives the firmware version of each.

    Raises:
        drivers.errors.ServoMissing: some are absent or of another model, all named at once.
    """
    numbers = {setup.id: registers.ping(setup.id) for setup in setups}
    if all(number is None for number in numbers.values()):
        raise ServoMissing(f"{where}: no servo answers: check servo power, cable and baud rate")
    problems = []
    for setup in setups:
        number = numbers[setup.id]
        if number is None:
            problems.append(f"servo {setup.id} does not answer")
        elif number != MODELS[setup.model].number:
            found = NAMES.get(number, f"model number {number}")
            problems.append(f"servo {setup.id} is {found}, not {setup.model}")
    _raise_if(problems, where, "check cables and ids")
    return _firmwares(registers, [setup.id for setup in setups], where)


def _firmwares(registers: Registers, ids: Sequence[int], where: str) -> dict[int, int]:
    """Read every servo's firmware version."""
    # A servo may be set to answer pings alone; this takes no answer and ends that.
    registers.write_all(ids, "status_return_level", 2)
    found = {servo_id: registers.read(servo_id, "firmware_version") for servo_id in ids}
    mute = [f"servo {servo_id} answers pings alone" for servo_id, v in found.items() if v is None]
    _raise_if(mute, where, "restart the servo power")
    return {servo_id: version for servo_id, version in found.items() if version is not None}


def prepare(registers: Registers, setups: Sequence[ServoSetup], where: str) -> None:
    """Bring every servo into position mode, torque off, speed capped, answering at once.

    Raises:
        drivers.errors.ServoMissing: a servo refuses, or does not allow the range configured.
    """
    problems = []
    for setup in setups:
        settings = (*WANTED, ("profile_velocity", speed_units(setup.max_speed_steps_s)))
        for name, value in settings:
            if not registers.settle(setup.id, name, value):
                problems.append(f"servo {setup.id} does not take {name} {value}")
        low = registers.read(setup.id, "min_position_limit")
        high = registers.read(setup.id, "max_position_limit")
        if low is None or high is None or setup.min_steps < low or setup.max_steps > high:
            wanted = f"{setup.min_steps}..{setup.max_steps}"
            problems.append(f"servo {setup.id} allows {low}..{high} steps, not {wanted}")
    _raise_if(problems, where, "set the servo up anew or correct the configuration")


def speed_units(speed_steps_s: float) -> int:
    """Give a speed in units of Profile Velocity, at least 1: there 0 means no limit."""
    return max(1, int(speed_steps_s / VELOCITY_UNIT_STEPS_S))


def _raise_if(problems: list[str], where: str, cure: str) -> None:
    if problems:
        raise ServoMissing(f"{where}: {'; '.join(problems)}: {cure}")
