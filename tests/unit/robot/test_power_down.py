"""Whatever ends the work, the head parks, torque goes off, and what could not be done is said."""

import signal
from collections.abc import Callable

import pytest

from gazerig.drivers.errors import BusLost, SetupError
from gazerig.program_signals import ProgramSignals
from gazerig.robot.loop.power_down import SAME_REQUEST_S, Interrupts, PowerDown


class Head:
    """Something that can be parked and switched off."""

    def __init__(self) -> None:
        self.did: list[str] = []
        self.said: list[str] = []
        self.during_parking: Callable[[], None] = lambda: None
        self.while_off: Callable[[], None] = lambda: None

    def park(self, again: Callable[[], bool]) -> str:
        self.did.append("park")
        self.during_parking()
        return "not parked (interrupted)" if again() else "parked"

    def off(self) -> None:
        self.while_off()
        self.did.append("off")

    def way_out(self, interrupts: Interrupts | None = None) -> PowerDown:
        return PowerDown(
            self.park, self.off, self.said.append, interrupts or Interrupts(), left=": cut it"
        )


@pytest.mark.parametrize(
    ("error", "cause", "what"),
    [
        (MemoryError(), "stopped by fault: unexpected MemoryError: ", "MemoryError"),
        (RuntimeError("x\ny"), "stopped by fault: unexpected RuntimeError: x y: ", "RuntimeError: x y"),
        (KeyboardInterrupt(), "stopped by an interrupt: ", "interrupted"),
        (SystemExit(3), "", "SystemExit: 3"),
        (BusLost("gone"), "", "gone"),
    ],
)  # fmt: skip
def test_whatever_ends_work_or_parking_the_torque_goes_off(error, cause, what):
    head, stuck = Head(), Head()
    with pytest.raises(type(error)), head.way_out() as leaving:
        assert leaving.switch_on(lambda: 7) == 7
        raise error

    def fail() -> None:
        raise error

    stuck.during_parking = fail
    with stuck.way_out() as leaving:
        leaving.switch_on(lambda: None)
    assert head.did == stuck.did == ["park", "off"]
    assert head.said == [f"{cause}parked, torque off"]
    assert stuck.said == [f"not parked ({what}), torque off"]


def test_torque_that_cannot_be_switched_off_is_said_with_what_to_do():
    head = Head()

    def fail() -> None:
        raise BusLost("no port")

    head.while_off = fail
    leaving = head.way_out()
    with leaving:
        leaving.switch_on(lambda: None)
    assert head.said == ["parked, torque-off could not be sent (no port): cut it"]
    assert leaving.unreleased == ("no port",)


def test_servos_that_do_not_confirm_are_said_even_where_success_is_not():
    head = Head()
    said: list[str] = []

    def off() -> tuple[str, ...]:
        return tuple(f"eye (servo {n}): torque-off not confirmed: cut it" for n in (1, 2, 3))

    with PowerDown(head.park, off, said.append, Interrupts(), quiet=True) as leaving:
        leaving.switch_on(lambda: None)
    eyes = "eye (servo 1), eye (servo 2), eye (servo 3)"
    assert said == [f"parked, torque off; {eyes}: torque-off not confirmed: cut it"]


class Seconds:
    """A clock that is set."""

    now = 0.0

    def __call__(self) -> float:
        return self.now

    def insist(self) -> None:
        for _ in range(5):
            ask(self)


def ask(clock: Seconds, number: signal.Signals = signal.SIGINT, after_s: float = 1.0) -> None:
    clock.now += after_s
    signal.raise_signal(number)


def test_a_start_that_is_refused_needs_no_end_and_one_that_breaks_off_does():
    def refused() -> None:
        raise SetupError("no servo")

    def broken() -> None:
        raise MemoryError

    for start, did in ((refused, []), (broken, ["off"])):
        head, clock = Head(), Seconds()
        head.while_off = clock.insist
        with (
            pytest.raises((SetupError, MemoryError)),
            Interrupts(clock) as interrupts,
            head.way_out(interrupts) as leaving,
        ):
            leaving.switch_on(start)
        assert head.did == did and head.said == []


def test_the_first_reason_to_end_stays_and_all_requests_count():
    others = iter((None, "the page"))
    asked = Interrupts(also=lambda: next(others))
    assert Interrupts.from_stop(asked) is asked and asked.requests == 0
    assert Interrupts.from_stop(lambda: "over")() == "over"
    asked.raise_if_requested()
    with pytest.raises(KeyboardInterrupt):
        asked.raise_if_requested()
    for _ in range(2):
        asked.request("later")
    assert asked() == "the page" and asked.requests == 3

    def slow() -> str:
        meanwhile.request("SIGTERM")
        return "the page"

    meanwhile = Interrupts(also=slow)
    assert meanwhile() == "SIGTERM"


def test_a_second_request_skips_parking_and_none_reaches_the_torque_off():
    head, clock = Head(), Seconds()

    def skipped() -> None:
        ask(clock)
        head.did.append("left off where it is safe")

    head.during_parking = skipped

    head.while_off = clock.insist
    with Interrupts(clock) as interrupts, head.way_out(interrupts) as leaving:
        leaving.switch_on(lambda: None)
        ask(clock)
        leaving.cause = interrupts() or ""
    assert head.did == ["park", "left off where it is safe", "off"]
    assert head.said == ["stopped by SIGINT: not parked (interrupted), torque off"]


def test_parking_that_hangs_is_broken_off_by_one_more():
    head, clock = Head(), Seconds()

    def hang() -> None:
        for _ in range(3):
            ask(clock)
        raise AssertionError("nobody broke it off")

    head.during_parking = hang
    with Interrupts(clock) as interrupts, head.way_out(interrupts) as leaving:
        leaving.switch_on(lambda: None)
        ask(clock)
    assert head.did == ["park", "off"] and "not parked (interrupted)" in head.said[0]


def test_signals_of_one_closed_terminal_are_one_request():
    clock = Seconds()
    with Interrupts(clock) as interrupts:
        ask(clock, signal.SIGHUP)
        ask(clock, signal.SIGHUP)
        assert interrupts() == "SIGHUP" and interrupts.requests == 1
    with Interrupts(clock) as interrupts:
        ask(clock, signal.SIGTERM)
        ask(clock, signal.SIGTERM, 0.5 * SAME_REQUEST_S)
        assert interrupts.requests == 1
        with pytest.raises(KeyboardInterrupt):
            ask(clock, signal.SIGTERM)


def test_handlers_are_put_back_and_nohup_is_heeded():
    numbers = (signal.SIGINT, signal.SIGHUP, signal.SIGQUIT, signal.SIGTTOU)
    before = [signal.getsignal(number) for number in numbers]
    with Interrupts() as interrupts, interrupts:
        assert [signal.getsignal(number) for number in numbers] != before
        for number in (signal.SIGTTIN, signal.SIGTTOU):  # they would stop it with the torque on
            assert signal.getsignal(number) == signal.SIG_IGN
    assert [signal.getsignal(number) for number in numbers] == before
    signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with Interrupts():
            assert signal.getsignal(signal.SIGHUP) == signal.SIG_IGN
    finally:
        signal.signal(signal.SIGHUP, signal.SIG_DFL)


class ParkingHead:
    """A head of a program that parks, and is asked to end."""

    closing = True

    def __init__(self) -> None:
        self.asked: list[str] = []

    def end(self, reason: str) -> None:
        self.asked.append(reason)


def test_signals_of_one_closed_terminal_do_not_skip_the_parking_of_a_program_s_head():
    signals, head = ProgramSignals(), ParkingHead()
    signals.add(head)
    try:
        for number in (signal.SIGTERM, signal.SIGTERM, signal.SIGHUP):
            signal.raise_signal(number)
    finally:
        signals.remove(head)
    assert head.asked == ["SIGTERM"]
    assert signal.getsignal(signal.SIGTERM) == signal.SIG_DFL
