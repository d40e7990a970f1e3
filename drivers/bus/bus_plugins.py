"""Our kinds of servo buses, registered like those of other packages."""

from collections.abc import Sequence
from typing import Any

from gazerig.drivers.bus.servo_families import FAMILY_OF
from gazerig.drivers.bus.servo_models import SERVOS
from gazerig.drivers.dynamixel.control_table import DynamixelParams
from gazerig.drivers.feetech.memory_table import FeetechParams
from gazerig.drivers.hobby_board.bus import HobbyBoardBus
from gazerig.drivers.maestro.board import MaestroBoard, MaestroParams
from gazerig.drivers.pca9685.board import Pca9685Board, Pca9685Params
from gazerig.drivers.plugins import BusPlugin
from gazerig.drivers.serial.port import BusPort
from gazerig.drivers.servo_bus.bus import SmartServoBus
from gazerig.drivers.types import ServoBus, ServoConfig


def _create_smart_bus(
    port: BusPort, own: Sequence[ServoConfig], params: DynamixelParams | FeetechParams
) -> ServoBus:
    """Return the bus of smart servos of one family."""
    return SmartServoBus(FAMILY_OF[own[0].model], port, own, params.baud)


def _create_maestro_bus(
    port: BusPort, own: Sequence[ServoConfig], params: MaestroParams
) -> ServoBus:
    """Return the bus of the hobby servos on a Maestro."""
    return HobbyBoardBus(MaestroBoard(port, params), own)


def _create_pca9685_bus(
    port: BusPort, own: Sequence[ServoConfig], params: Pca9685Params
) -> ServoBus:
    """Return the bus of the hobby servos on PCA9685 boards."""
    return HobbyBoardBus(Pca9685Board(port, params), own)


def _plugin(kind: str, **facts: Any) -> BusPlugin:
    models = {name: model for name, model in SERVOS.items() if model.bus == kind}
    return BusPlugin(models=models, **facts)


DYNAMIXEL = _plugin("dynamixel", make=_create_smart_bus, params=DynamixelParams)
FEETECH = _plugin("feetech", make=_create_smart_bus, params=FeetechParams)
MAESTRO = _plugin("maestro", make=_create_maestro_bus, params=MaestroParams)
PCA9685 = _plugin("pca9685", make=_create_pca9685_bus, params=Pca9685Params)
