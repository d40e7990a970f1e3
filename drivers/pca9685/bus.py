"""Bus of hobby servos on PCA9685 boards."""

from collections.abc import Sequence

from gazerig.drivers.hobby_board.bus import HobbyBoardBus
from gazerig.drivers.pca9685.board import Pca9685Board
from gazerig.drivers.pca9685.params import Pca9685Params as Pca9685Params
from gazerig.drivers.serial.port import BusPort
from gazerig.drivers.types import ServoConfig


class Pca9685Bus(HobbyBoardBus):
    """The channels of the boards on one I2C bus; implements gazerig.drivers.types.ServoBus.

    Args:
        port: gazerig.drivers.i2c.port.I2cPort, or a serial or emulated port with a bridge.
        setups: The servos, in the order of all sequences; a servo's id is its channel, and steps
            are quarter microseconds.
        params: Addresses and timing of the boards.

    Raises:
        ValueError: a servo has a channel or a pulse width that the boards do not have.
    """

    def __init__(self, port: BusPort, setups: Sequence[ServoConfig], params: Pca9685Params) -> None:
        super().__init__(Pca9685Board(port, params), setups)
