"""Configurable cases of each kind of emulated device in one module that imports them all."""

from collections.abc import Mapping

from gazerig.drivers.bus.servo_models import BusKind
from gazerig.sim_mock.dynamixel.chain import DynamixelChain
from gazerig.sim_mock.feetech.chain import FeetechChain
from gazerig.sim_mock.maestro import settings as maestro_settings
from gazerig.sim_mock.pca9685.body import CASES as PCA9685_CASES

CASES: dict[BusKind, Mapping[str, str]] = {
    "dynamixel": DynamixelChain.commands.cases,
    "feetech": FeetechChain.commands.cases,
    "maestro": maestro_settings.cases(),
    "pca9685": PCA9685_CASES,
}
"""Kind -> cases, and their values as they are typed."""
