"""Servos without bytes: goals in, a first-order lag out, for tests of what is above the bus.

`with ideal_buses():` has every robot that is assembled inside it on such servos; half the
processor time of a simulated run goes into packets and motors otherwise. They start where the
emulated ones would, and the simulated camera sits on the head that they carry.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from math import exp

import pytest

from gazerig.config.schema import Rig
from gazerig.drivers.servo_models import HOBBY_KINDS
from gazerig.drivers.types import BusHealth, Feedback, ServoConfig
from gazerig.robot.app import run_bus
from gazerig.robot.app.bus_wiring import rig_setups
from gazerig.robot.app.emulation import place_of
from gazerig.sim_mock.devices import Emulated, build

LAG_S = 0.008
"""An emulated eye on the desk rig's gains is as late."""


class IdealLine:
    """The shafts of one bus; stands where the emulated device would."""

    def __init__(self, line: Emulated, now_s: Callable[[], float]) -> None:
        self.positions = list(map(float, build(line, now_s).positions_steps()))

    def positions_steps(self) -> tuple[float, ...]:
        return tuple(self.positions)


class IdealBus:
    """All servos of a rig; implements gazerig.drivers.types.ServoBus."""

    def __init__(self, rig: Rig, lines: Mapping[str, IdealLine]) -> None:
        self._shafts = [(lines[rig.joints[n].bus].positions, place_of(rig, n)) for n in rig.names]
        self._measured = tuple(rig.bus_of(name).kind not in HOBBY_KINDS for name in rig.names)
        self._setups = rig_setups(rig)
        self._goals: tuple[int, ...] = ()
        self._torque = False
        self._last_s: float | None = None
        self._events: tuple[str, ...] = ()

    def open(self) -> None:
        self._events = ("servos set up",)

    def close(self) -> None: ...

    def read(self, now_s: float) -> Feedback:
        passed_s = 0.0 if self._last_s is None else now_s - self._last_s
        share, self._last_s = 1.0 - exp(-passed_s / LAG_S), now_s
        speeds = [0.0] * len(self._shafts)
        if self._torque:
            for i, ((positions, place), goal) in enumerate(
                zip(self._shafts, self._goals, strict=True)
            ):
                step = (goal - positions[place]) * share
                positions[place] += step
                speeds[i] = step / passed_s if passed_s > 0.0 else 0.0
        n = len(self._shafts)
        return Feedback(
            tuple([float(round(positions[place])) for positions, place in self._shafts]),
            tuple(speeds), (0.0,) * n, (now_s,) * n, tuple([30.0 if reported else None for reported in self._measured]), (None,) * n,
            (self._torque,) * n, ("",) * n, self._measured, (False,) * n, (),
        )  # fmt: skip

    def enable_torque(self) -> tuple[int, ...]:
        self._torque = True
        self.write([round(positions[place]) for positions, place in self._shafts])
        return self._goals

    def write(self, goals_steps: Sequence[int]) -> None:
        pairs = zip(self._setups, goals_steps, strict=True)
        self._goals = tuple([min(max(goal, s.min_steps), s.max_steps) for s, goal in pairs])

    def disable_torque(self) -> None:
        self._torque = False

    def retune(self, setups: Sequence[ServoConfig]) -> None:
        self._setups = tuple(setups)

    def faults(self) -> tuple[str, ...]:
        return ()

    def events(self) -> tuple[str, ...]:
        events, self._events = self._events, ()
        return events

    def health(self) -> BusHealth:
        return BusHealth(0, 0, {})


@contextmanager
def ideal_buses() -> Iterator[None]:
    """Have robots that are assembled meanwhile, in simulated time, on ideal servos."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(run_bus, "build", IdealLine)
        patch.setattr(run_bus, "InProcessPort", lambda line, sent: line)
        patch.setattr(run_bus, "rig_bus", IdealBus)
        yield
