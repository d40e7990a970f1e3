"""The port that the vendor's SDK needs, over an emulated device in this process."""

from gazerig.drivers.serial.port import BusPort


class SdkPort:
    """A port whose clock advances with each wait."""

    is_using = False

    def __init__(self, port: BusPort) -> None:
        self._port = port
        self._give_up_s = 0.0

    def getBaudRate(self) -> int:
        return 1_000_000

    def clearPort(self) -> None:
        self._port.drain(0.0)

    def writePort(self, packet: list[int]) -> int:
        self._port.write(bytes(packet))
        return len(packet)

    def readPort(self, length: int) -> bytes:
        return self._port.read_until(length, self._port.now_s() + 1e-4)

    def setPacketTimeout(self, length: int) -> None:
        self.setPacketTimeoutMillis(0.01 * length + 34.0)

    def setPacketTimeoutMillis(self, msec: float) -> None:
        self._give_up_s = self._port.now_s() + msec / 1e3

    def isPacketTimeout(self) -> bool:
        return self._port.now_s() > self._give_up_s
