"""Our kinds of servo buses, registered like those of other packages."""

from collections.abc import Sequence
from typing import Any

from gazerig.drivers.bus.servo_families import FAMILY_OF
from gazerig.drivers.bus.servo_models import SERVOS
from gazerig.drivers.dynamixel.params import DynamixelParams
from gazerig.drivers.feetech.params import FeetechParams
from gazerig.drivers.maestro.board import MaestroBus
from gazerig.drivers.maestro.params import MaestroParams
from gazerig.drivers.pca9685.board import Pca9685Bus
from gazerig.drivers.pca9685.params import Pca9685Params
from gazerig.drivers.plugins import BusPlugin
from gazerig.drivers.serial.port import BusPort
from gazerig.drivers.servo_bus.bus import SmartServoBus
from gazerig.drivers.types import ServoBus, ServoConfig


def _create_smart_bus(
    port: BusPort, own: Sequence[ServoConfig], params: DynamixelParams | FeetechParams
) -> ServoBus:
    """Return the bus of smart servos of one family."""
    return SmartServoBus(FAMILY_OF[own[0].model], port, own, params.baud)


def _plugin(kind: str, **facts: Any) -> BusPlugin:
    models = {name: model for name, model in SERVOS.items() if model.bus == kind}
    return BusPlugin(models=models, **facts)


DYNAMIXEL = _plugin("dynamixel", make=_create_smart_bus, params=DynamixelParams)
FEETECH = _plugin("feetech", make=_create_smart_bus, params=FeetechParams)
MAESTRO = _plugin("maestro", make=MaestroBus, params=MaestroParams)
PCA9685 = _plugin("pca9685", make=Pca9685Bus, params=Pca9685Params, moves=("hobby",))
