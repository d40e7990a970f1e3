"""Our kinds of servo buses, registered like those of other packages."""

from collections.abc import Sequence

from gazerig.drivers.bus.servo_models import FAMILY_OF
from gazerig.drivers.dynamixel.control_table import DynamixelParams
from gazerig.drivers.feetech.memory_table import FeetechParams
from gazerig.drivers.hobby_board.bus import HobbyBoardBus
from gazerig.drivers.maestro.board import MaestroBoard, MaestroParams
from gazerig.drivers.pca9685.board import Pca9685Board, Pca9685Params
from gazerig.drivers.plugins import BusPlugin
from gazerig.drivers.serial.port import BusPort
from gazerig.drivers.servo_bus.bus import SmartServoBus
from gazerig.drivers.types import ServoBus, ServoConfig


def _smart(
    port: BusPort, own: Sequence[ServoConfig], params: DynamixelParams | FeetechParams
) -> ServoBus:
    return SmartServoBus(FAMILY_OF[own[0].model], port, own, params.baud)


DYNAMIXEL = BusPlugin(_smart, DynamixelParams)
FEETECH = BusPlugin(_smart, FeetechParams)
MAESTRO = BusPlugin(
    lambda port, own, params: HobbyBoardBus(MaestroBoard(port, params), own), MaestroParams
)
PCA9685 = BusPlugin(
    lambda port, own, params: HobbyBoardBus(Pca9685Board(port, params), own), Pca9685Params
)
