"""gazerig's own suite on this bus."""

from collections.abc import Sequence

from gazerig_lx16a.bus import Lx16aBus, Lx16aParams
from gazerig_lx16a.emulated import chain_of

from gazerig.drivers.serial.port import BusPort
from gazerig.drivers.types import ServoConfig
from gazerig.testing import BusSuite, BusUnderTest


def make(port: BusPort, setups: Sequence[ServoConfig], give_up_s: float) -> Lx16aBus:
    return Lx16aBus(port, setups, Lx16aParams(reply_timeout_ms=5.0, give_up_s=give_up_s))


class TestBus(BusSuite):
    under_test = BusUnderTest("lx-16a", 100, 900, 800.0, make, chain_of)
