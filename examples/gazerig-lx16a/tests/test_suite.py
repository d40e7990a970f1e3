"""gazerig's own suites on this bus."""

from collections.abc import Sequence
from pathlib import Path

from gazerig_lx16a.bus import Lx16aBus, Lx16aParams
from gazerig_lx16a.emulated import chain_of

from gazerig.drivers.serial.port import BusPort
from gazerig.drivers.types import ServoConfig
from gazerig.testing import BusLossSuite, BusSuite, BusUnderTest, FaultSuite


def make(port: BusPort, setups: Sequence[ServoConfig], patient: bool, give_up_s: float) -> Lx16aBus:
    timeout_ms = 200.0 if patient else 5.0
    return Lx16aBus(port, setups, Lx16aParams(reply_timeout_ms=timeout_ms, give_up_s=give_up_s))


LX16A = BusUnderTest("lx16a", "lx-16a", 100, 900, 800.0, make, chain_of)


class TestBehaviour(BusSuite):
    under_test = LX16A


class TestLoss(BusLossSuite):
    under_test = LX16A


class TestFaults(FaultSuite):
    rig_file = str(Path(__file__).parents[1] / "head.yaml")
    rate_hz = 40.0
