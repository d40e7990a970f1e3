"""Bus of hobby servos on a Pololu Maestro."""

from collections.abc import Sequence

from gazerig.drivers.hobby_board.bus import HobbyBoardBus
from gazerig.drivers.maestro.board import MaestroBoard
from gazerig.drivers.maestro.commands import MICRO
from gazerig.drivers.maestro.params import MaestroParams as MaestroParams
from gazerig.drivers.serial.port import BusPort
from gazerig.drivers.types import ServoConfig


class MaestroBus(HobbyBoardBus):
    """The channels of one Maestro; implements gazerig.drivers.types.ServoBus.

    Args:
        port: gazerig.drivers.serial.port.BlockingPort, or an emulated port with its methods.
        setups: The servos, in the order of all sequences; a servo's id is its channel, and steps
            are quarter microseconds.
        params: Communication parameters.

    Raises:
        ValueError: a servo has a channel or a pulse width that the board does not have.
    """

    def __init__(self, port: BusPort, setups: Sequence[ServoConfig], params: MaestroParams) -> None:
        self._maestro = MaestroBoard(port, params)
        super().__init__(self._maestro, setups)

    def go_home(self) -> None:
        """Send all channels to their home as set in Pololu's program, and release them.

        Home may be a position, to which servos move at the armed speed, or no pulses at all.

        Raises:
            BusLost: the port is lost.
        """
        self._supervisor.stop_supervision()
        self._maestro.line.send(self._maestro.line.speech.go_home())

    def moving(self) -> bool | None:
        """Return whether any channel with a limit is moving; None if unknown.

        The Micro Maestro has no such request.

        Raises:
            BusLost: the port is lost.
        """
        if self._maestro.params.channels <= MICRO:
            return None
        answer = self._maestro.line.ask(self._maestro.line.speech.moving(), 1)
        return None if answer is None else bool(answer[0])
