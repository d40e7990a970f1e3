"""A busy computer is reported as such, and not as a bad plug."""

import os
import re

import pytest
from bus_kinds import in_process

from gazerig.drivers.errors import PortError, ServoMissing
from gazerig.drivers.process.host_lateness import AFTERMATH_S, HostLateness
from gazerig.drivers.serial.port import BlockingPort

KINDS = ("dynamixel", "feetech", "maestro", "pca9685")
BLAME = r"check|cable\b|with its id|program|supply too weak"
"""Words that name something else than this computer."""


def test_what_servos_do_soon_after_a_late_computer_is_put_down_to_it():
    lateness = HostLateness()
    assert lateness.blame("no answer", "check its cable", 0.0) == "no answer: check its cable"
    lateness.record_own_silence(0.7, 5.0)
    lateness.record_own_silence(0.12, 5.1)  # the longest of one episode is reported
    assert lateness.cause(5.2) == "this computer was late: it sent nothing for 0.70 s"
    assert lateness.cause(5.2 + AFTERMATH_S) == ""


@pytest.mark.parametrize("kind", ["dynamixel", "feetech", "pca9685"])
def test_answers_that_come_late_are_the_computer_s_not_a_plug_s(kind):
    bench = in_process(kind)
    bus = bench.hold()
    bench.ticks(bus, 0.5)
    bench.command("delay all 40")
    bench.ticks(bus, 2.0)
    told = bus.events()
    assert any(re.search("this computer (is|was) busy", text) for text in told), told
    assert not [text for text in told if re.search(BLAME, text)]


@pytest.mark.parametrize("kind", KINDS)
def test_a_start_that_fails_while_the_computer_is_late_blames_no_plug(kind):
    bench = in_process(kind)
    bench.command("delay all 100")
    port, sleep_until = bench.port, bench.port._sleep_until  # type: ignore[attr-defined]
    port._sleep_until = lambda until_s: sleep_until(until_s + 0.03)  # type: ignore[attr-defined]
    with pytest.raises(ServoMissing, match="this computer was busy") as caught:
        bench.hold()
    assert not re.search(BLAME, str(caught.value))


def test_a_host_that_slept_is_told_as_that_and_servos_go_on():
    bench = in_process("dynamixel")
    bus = bench.hold()
    bench.ticks(bus, 0.5)
    bench.wait(0.5)  # the loop was stopped; the servos' own watchdog is not
    bench.ticks(bus, 0.4)
    assert sum("this computer was late: it sent nothing for 0.5" in t for t in bus.events()) == 1
    bench.go(bus, [0.5] * 4)
    assert "restarted" not in bus.health().errors and bus.faults() == ()


def test_an_adaptor_is_found_again_under_another_name_and_no_other_is_taken_for_it(tmp_path):
    """Two pseudo-terminals with names that they keep, and a path that is now the first."""
    by_id, named = tmp_path / "by-id", tmp_path / "ttyUSB0"
    by_id.mkdir()
    paths = [os.ttyname(os.openpty()[1]) for _ in range(2)]
    for name, path in zip(("usb-A", "usb-B"), paths, strict=True):
        (by_id / name).symlink_to(path)
    named.symlink_to(paths[0])
    port = BlockingPort(str(named))
    port.by_id = by_id
    assert port.setBaudRate(1_000_000)
    assert port.opened_as == str(named)
    named.unlink()  # back as another ttyUSB
    assert port.setBaudRate(1_000_000)
    assert port.opened_as == paths[0]
    named.symlink_to(paths[1])  # another adaptor has got the name
    assert port.setBaudRate(1_000_000)
    assert port.opened_as == paths[0]
    (by_id / "usb-A").unlink()
    with pytest.raises(PortError, match="no serial port .*usb-A"):
        port.setBaudRate(1_000_000)
    port.closePort()
