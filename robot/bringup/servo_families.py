"""The kinds of smart servos, each as bring-up deals with it."""

from drivers.dynamixel.control_table import MODELS as DYNAMIXEL_MODELS
from drivers.feetech import assign as feetech_assign
from drivers.feetech import scan as feetech_scan
from drivers.feetech.memory_table import MODELS as FEETECH_MODELS
from drivers.serial.port import BusPort
from drivers.servo_bus import discovery as dynamixel_scan
from drivers.types import ServoSetup
from robot.bringup import dynamixel_assign, dynamixel_care, feetech_care
from robot.bringup.doctor import checks as doctor
from robot.bringup.doctor import feetech as doctor_feetech
from robot.bringup.servo_kind import Found, ServoKind, SetUp, Tell


def _assign_dynamixel(
    port: BusPort, found: Found, setup: ServoSetup, baud: int, tell: Tell
) -> SetUp:
    seen = dynamixel_scan.Found(found.id, found.number, found.firmware, found.baud)
    return dynamixel_assign.assign(port, seen, setup, baud, tell)


def _assign_feetech(port: BusPort, found: Found, setup: ServoSetup, baud: int, tell: Tell) -> SetUp:
    tell(f"id {found.id} -> {setup.id}, {found.baud} -> {baud} bit/s")
    seen = feetech_scan.Found(found.id, found.number, found.firmware, found.baud)
    return SetUp(*feetech_assign.assign(port, seen, setup.id, baud))


DYNAMIXEL = ServoKind(
    name="dynamixel",
    title="Dynamixel",
    rates=dynamixel_scan.COMMON_FIRST,
    factory_baud=dynamixel_scan.FACTORY_BAUD,
    nobody="is the servo supply on? does each servo's LED flash once when it comes on? is the "
    "adaptor's plug the TTL one (3 pins), and the first cable in?",
    notes=(),
    version=str,
    number=lambda model: DYNAMIXEL_MODELS[model].number,
    everybody=dynamixel_scan.everybody,
    anybody=lambda port: True,
    ping=dynamixel_scan.ping,
    garbled=dynamixel_scan.garbled,
    assign=_assign_dynamixel,
    examine=doctor.visit,
    mend=dynamixel_care.mend,
    standing=dynamixel_care.standing,
    reboot=dynamixel_scan.reboot,
)

FEETECH = ServoKind(
    name="feetech",
    title="Feetech STS",
    rates=feetech_scan.COMMON_FIRST,
    factory_baud=feetech_scan.FACTORY_BAUD,
    nobody="is the servo supply on, and its voltage that of the servos (7.4 or 12 V)? is the "
    "first cable in, and the adaptor's jumper set to USB?",
    notes=(
        "an STS has no bus watchdog: if the cable or the computer dies it holds its last goal; "
        "keep the switch of the servo supply at hand",
    ),
    version=lambda firmware: f"{firmware // 100}.{firmware % 100}",
    number=lambda model: FEETECH_MODELS[model].number,
    everybody=feetech_scan.everybody,
    anybody=feetech_scan.anybody,
    ping=feetech_scan.ping,
    garbled=feetech_scan.garbled,
    assign=_assign_feetech,
    examine=doctor_feetech.visit,
    mend=feetech_care.mend,
    standing=feetech_care.standing,
    reboot=feetech_care.reboot,
)

KINDS: dict[str, ServoKind] = {"dynamixel": DYNAMIXEL, "feetech": FEETECH}
"""By the name that a rig's YAML gives them."""
