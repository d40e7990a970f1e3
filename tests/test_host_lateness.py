"""A busy computer is reported as such, and not as a bad plug."""

import os
import re

import pytest
from line_noise import IDS, Noisy

from gazerig.drivers.errors import PortError, ServoMissing
from gazerig.drivers.process.host_lateness import (
    AFTERMATH_S,
    BUSY,
    LATE_COMPUTER,
    OVERSLEPT_S,
    WITHIN_S,
    HostLateness,
)
from gazerig.drivers.serial.port import BlockingPort
from gazerig.drivers.servo_bus.faults import GARBLES
from gazerig.drivers.servo_bus.supervisor import NOT_SET_UP

SYNC_READ = 0x82

KINDS = ("dynamixel", "feetech")
BLAME = r"check|cable\b|with its id|program|supply too weak"
"""Words that name something else than this computer."""


def test_few_late_answers_are_no_busy_computer():
    lateness = HostLateness()
    for k in range(BUSY - 1):
        lateness.record_late_answer(5.0 + 0.01 * k)
    assert lateness.late_answers(5.1) == 0
    lateness.record_late_answer(5.1)
    assert lateness.late_answers(5.1) == BUSY
    assert lateness.late_answers(5.2 + WITHIN_S) == 0


def test_what_servos_do_soon_after_a_late_computer_is_put_down_to_it():
    lateness = HostLateness()
    assert lateness.cause(0.0) == ""
    lateness.record_own_silence(0.7, 5.0)
    lateness.record_own_silence(0.12, 5.1)  # the longest of one episode is reported
    assert lateness.cause(5.2) == "this computer was late: it sent nothing for 0.70 s"
    assert lateness.cause(5.2 + AFTERMATH_S) == ""
    lateness.record_own_silence(0.2, 9.0)
    assert "0.20 s" in lateness.cause(9.0)
    starved = HostLateness()
    starved.record_late_answer(3.0)
    assert "the emulator was suspended" in starved.cause(3.5)
    assert starved.cause(3.0 + 2 * AFTERMATH_S) == ""


@pytest.mark.parametrize("kind", (*KINDS, "pca9685"))
def test_answers_that_come_late_are_the_computer_s_not_a_plug_s(kind):
    noisy = Noisy(kind)
    noisy.start()
    outcome = noisy.run("delay all 40", 0.0, 150)
    assert any(re.search("this computer (is|was) busy", text) for text in outcome.said), (
        outcome.said
    )
    blaming = [text for text in outcome.said if re.search(BLAME, text)]
    assert not blaming, blaming
    assert outcome.wrong == 0


@pytest.mark.parametrize("kind", (*KINDS, "maestro", "pca9685"))
def test_a_start_that_fails_while_the_computer_is_late_blames_no_plug(kind):
    noisy = Noisy(kind)
    noisy.device.faults.command("delay all 100")
    noisy.port._sleep_until = lambda until_s: noisy._sleep_until(until_s + 0.03)
    with pytest.raises(ServoMissing, match="this computer was busy") as caught:
        noisy.start()
    assert not re.search(BLAME, str(caught.value))


@pytest.mark.parametrize("kind", (*KINDS, "maestro", "pca9685"))
def test_an_emulator_that_was_suspended_is_named_in_one_line(kind, monkeypatch):
    noisy = Noisy(kind)
    noisy.start()
    held: list[bytes] = []
    with monkeypatch.context() as suspended:
        suspended.setattr(noisy.port, "write", held.append)
        said = noisy.run("clear", 0.0, 100, 0.0).said
    for data in held:
        noisy.port.write(data)
    (line,) = said + noisy.run("clear", 0.0, 100).said
    assert "the emulator was suspended" in line and not re.search(BLAME, line), line


@pytest.mark.parametrize("kind", KINDS)
def test_bytes_damaged_while_the_computer_is_late_mean_no_second_id(kind):
    noisy = Noisy(kind)
    noisy.start()
    noisy.device.faults.command("delay 6 18 count 3")
    said = noisy.run("corrupt 3", 0.0, 300, 0.0).said
    (text,) = [text for text in said if GARBLES in text]
    assert "this computer was busy" in text and not re.search(BLAME, text)


@pytest.mark.parametrize("kind", KINDS)
def test_short_pauses_of_the_computer_cost_no_value(kind):
    noisy = Noisy(kind)
    noisy.start()
    for ms in (3, 8, 8, 8):  # one after the other: an answer that comes costs no reserve
        outcome = noisy.run(f"delay all {ms} count 1", 0.0, 40)
        assert outcome.damaged == 0, outcome
    assert noisy.run("delay all 18 count 1", 0.0, 40).damaged > 0


@pytest.mark.parametrize("kind", KINDS)
def test_a_servo_that_is_silent_is_named_where_nothing_comes_late(kind):
    noisy = Noisy(kind)
    noisy.start()
    outcome = noisy.run("lose 3", 0.0, 150)
    assert any("joint_3 (servo 3) does not answer" in text for text in outcome.said)
    assert not any("busy" in text for text in outcome.said)


def test_a_host_that_slept_is_told_as_that_and_servos_go_on():
    noisy = Noisy("dynamixel")
    noisy.start()
    noisy.now += 0.5  # the loop was stopped; the servos' own watchdog is not
    outcome = noisy.run("clear", 0.0, 40)
    assert sum("this computer was late: it sent nothing for 0.5" in t for t in outcome.said) == 1
    assert outcome.errors[LATE_COMPUTER] == 6 and "watchdog" not in outcome.errors
    assert "restarted" not in outcome.errors
    assert outcome.outside == 0


@pytest.mark.parametrize("since_s", [5.0, None])
def test_one_rule_decides_whether_a_cable_is_blamed(since_s):
    lateness = HostLateness()
    begin = {} if since_s is None else {"since_s": since_s}
    assert (
        lateness.blame("no answer", "check its cable", 9.0, **begin) == "no answer: check its cable"
    )
    lateness.record_wait(6.0, 6.0 + 0.9 * OVERSLEPT_S)
    assert lateness.cause(6.0) == ""
    lateness.record_wait(6.0, 6.0 + 1.1 * OVERSLEPT_S)
    text = lateness.blame("no answer", "check its cable", 9.0, **begin)
    assert ("this computer was busy" in text) == (since_s is not None)
    assert ("check" in text) == (since_s is None)


# --- which port it is


def adaptors(folder):
    """Two pseudo-terminals with names that they keep, and a path that is now the first."""
    ends = [os.openpty() for _ in range(2)]
    by_id = folder / "by-id"
    by_id.mkdir()
    paths = [os.ttyname(slave) for _, slave in ends]
    for name, path in zip(("usb-A", "usb-B"), paths, strict=True):
        (by_id / name).symlink_to(path)
    named = folder / "ttyUSB0"
    named.symlink_to(paths[0])
    return by_id, named, paths


def test_an_adaptor_is_found_again_under_another_name_and_no_other_is_taken_for_it(tmp_path):
    by_id, named, paths = adaptors(tmp_path)
    port = BlockingPort(str(named), by_id=by_id)
    assert port.setBaudRate(1_000_000)
    assert port.opened_as == str(named)
    named.unlink()  # back as another ttyUSB
    assert port.setBaudRate(1_000_000)
    assert port.opened_as == paths[0]
    named.symlink_to(paths[1])  # another adaptor has got the name
    assert port.setBaudRate(1_000_000)
    assert port.opened_as == paths[0]
    (by_id / "usb-A").unlink()
    with pytest.raises(PortError, match="is another adaptor now"):
        port.setBaudRate(1_000_000)
    port.closePort()


def test_servos_that_cannot_be_set_up_in_time_have_no_second_id():
    """After a brown-out each servo is set up by many questions, whose answers come late here."""
    noisy = Noisy("dynamixel")
    noisy.start()
    for servo_id in IDS:
        noisy.device.faults.command(f"brown-out {servo_id}")
    write = noisy.port.write

    def delayed(data):
        if data[7] == SYNC_READ:  # the loop's own request is another one
            noisy.device.faults.command("delay all 18 count 6")
        write(data)

    noisy.port.write = delayed  # type: ignore[method-assign]
    outcome = noisy.run("clear", 0.0, 900)
    failed = [text for text in outcome.said if NOT_SET_UP in text]
    assert failed and all("this computer was busy" in text for text in failed), outcome.said
    blaming = [text for text in outcome.said if re.search(BLAME, text)]
    # All servos lost their power, which is told.
    assert all(text.startswith("no servo answered") for text in blaming), blaming
