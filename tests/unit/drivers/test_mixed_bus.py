"""Several buses as one: who is where, and whose trouble is whose. With buses written out here."""

from collections import Counter
from math import nan
from typing import Any

import pytest
from feedback_rows import Row, feedback_of, rows

from gazerig.drivers.bus.multi_bus import BusShare, MultiBus
from gazerig.drivers.errors import BusLost, PortError, ServoMissing
from gazerig.drivers.types import BusHealth, ServoConfig

WANTED = tuple(ServoConfig(i, "xl330-m077", 0, 4095, 100.0) for i in range(5))


def row_at(steps, now_s):
    """Return a servo's feedback, with a different value in every column."""
    return Row(
        steps, steps + 0.1, steps / 100.0, now_s, steps + 0.3, None if steps % 2 else steps + 0.4,
        steps % 2 == 0, f"fault {steps}", steps % 3 > 0, steps % 5 == 0,
    )  # fmt: skip


class Scripted:
    """A bus of a few servos that records its calls, and fails in the given ones.

    Servos are named by a letter and are at steps of their own; wrong: methods that raise
    """

    def __init__(self, name, steps, log):
        self.name, self.steps, self.log = name, list(steps), log
        self.wrong = {}

    def _do(self, what):
        self.log.append(f"{self.name} {what}")
        if what in self.wrong:
            raise self.wrong[what]

    def open(self):
        self._do("open")

    def read(self, now_s):
        self._do("read")
        return feedback_of([row_at(at, now_s) for at in self.steps])

    def enable_torque(self):
        self._do("enable_torque")
        return tuple(self.steps)

    def write(self, goals_steps):
        self._do("write")
        self.steps = list(goals_steps)

    def faults(self):
        return (f"{self.name}: overload",)

    def events(self):
        return (f"{self.name} says",)

    def disable_torque(self):
        self._do("disable_torque")

    def health(self):
        return BusHealth(10, 20, Counter({"timeout": 1, self.name: 2}))

    def close(self):
        self._do("close")


class Mixture:
    """Servos 1, 3 and 4 on bus a, servos 2 and 0 (in this order) on bus b."""

    def __init__(self):
        self.log: list[Any] = []
        self.a = Scripted("a", (11, 13, 14), self.log)
        self.b = Scripted("b", (12, 10), self.log)
        shares = [BusShare("a", self.a, (1, 3, 4)), BusShare("b", self.b, (2, 0))]
        self.bus = MultiBus(shares, WANTED)

    def reported(self):
        log, self.log[:] = list(self.log), []
        return log


@pytest.fixture
def mixture():
    return Mixture()


def test_every_sequence_is_in_the_order_of_the_whole(mixture):
    assert mixture.bus.enable_torque() == (10, 11, 12, 13, 14)
    reported = mixture.bus.read(1.0)
    assert rows(reported) == tuple(row_at(at, 1.0) for at in (10, 11, 12, 13, 14))
    assert reported.missing == ()
    mixture.bus.write([20, 21, 22, 23, 24])
    assert (mixture.a.steps, mixture.b.steps) == ([21, 23, 24], [22, 20])
    assert mixture.bus.faults() == ("a: overload", "b: overload")
    assert mixture.bus.events() == ("a says", "b says")
    assert mixture.bus.health() == (20, 40, {"timeout": 2, "a": 2, "b": 2})


def test_open_closes_what_is_open_where_the_next_cannot_be(mixture):
    mixture.b.wrong["open"] = PortError("no port")
    with pytest.raises(PortError, match="no port"):
        mixture.bus.open()
    assert mixture.reported() == ["a open", "b open", "a close"]


def test_release_reaches_all_and_names_every_port_that_is_gone(mixture):
    mixture.a.wrong["disable_torque"] = BusLost("port a is gone")
    mixture.b.wrong["enable_torque"] = ServoMissing("servo 2 refuses")
    with pytest.raises(ServoMissing, match="servo 2 refuses"):
        mixture.bus.enable_torque()
    each = ["a disable_torque", "b disable_torque"]
    assert mixture.reported() == ["a enable_torque", "b enable_torque", *each]
    mixture.b.wrong["disable_torque"] = BusLost("port b is gone")
    with pytest.raises(BusLost, match="^port a is gone; port b is gone$"):
        mixture.bus.disable_torque()
    assert mixture.reported() == each


@pytest.mark.parametrize("goals", [[1, 2, 3, 4, nan], [nan, 2, 3, 4, 5], [1, 2, 3, 4], [1] * 6])
def test_goals_that_cannot_be_reach_no_bus_at_all(mixture, goals):
    with pytest.raises(ValueError, match="not a number|goals for 5 servos"):
        mixture.bus.write(goals)
    assert mixture.reported() == []
