"""Ideal servos of a world, without bus packets: they follow goals with a lag, whatever the load."""

from collections.abc import Callable, Sequence

from gazerig.drivers.types import ServoConfig
from gazerig.features.world.shaft import LIMP, SPEED_UNIT, Effort, ShaftAxis
from gazerig.sim_mock.ideal.bus import LAG_S, IdealBus, Steps
from gazerig.sim_mock.smart_servo.physics import MS_S

ROTOR_KG_M2 = 2e-4
FRICTION_NM = 0.006
"""The friction of an XL330, so that a limp head does not fall."""

HOLD_NM_S = 2.0
"""Torque per rad/s by which the shaft is too slow."""
MOST_NM = 3.0


class IdealShaft:
    """A shaft that approaches its goal with a time constant.

    Args:
        axis: the shaft in the world.
        steps_per_turn: of its servo.

    Attributes:
        goal: in steps of its servo; None while its torque is off.
    """

    def __init__(self, axis: ShaftAxis, steps_per_turn: float) -> None:
        self.axis = axis
        self.goal: float | None = None
        self._unit = 4096.0 / steps_per_turn
        self._x = axis.position()
        self._v = 0.0
        axis.build(ROTOR_KG_M2, FRICTION_NM)

    @property
    def place_steps(self) -> float:
        """Return its position."""
        return self.axis.position() / self._unit

    @property
    def speed_steps_s(self) -> float:
        """Return its speed."""
        return self._v / (MS_S * self._unit)

    def command(self) -> Effort:
        """Return the effort of its motor in the next millisecond."""
        if self.goal is None:
            return LIMP
        wanted = (self.goal * self._unit - self._x) / (LAG_S * 1000.0)
        return HOLD_NM_S * wanted / SPEED_UNIT, -HOLD_NM_S, -MOST_NM, MOST_NM

    def sense(self, x: float, v: float) -> None:
        """Set position (4096 steps a turn) and speed (steps/ms) to the results of the world."""
        self._x, self._v = x, v


class WorldIdealBus(IdealBus):
    """All servos of a rig in a world; a gazerig.drivers.types.ServoBus."""

    def __init__(
        self,
        configs: Sequence[ServoConfig],
        shafts: Sequence[IdealShaft],
        measured: Sequence[bool],
        now_s: Callable[[], float],
    ) -> None:
        self._shafts = tuple(shafts)
        super().__init__(configs, [one.place_steps for one in shafts], measured, now_s)

    @property
    def has_torque(self) -> bool:
        """Return whether the shafts follow goals."""
        return self._shafts[0].goal is not None

    def positions_steps(self) -> Steps:
        """Return the true positions now, in the order of the servos."""
        self._now_s()
        return tuple([one.place_steps for one in self._shafts])

    def disable_torque(self) -> None:
        """Switch off the torque of the shafts."""
        self._now_s()
        for one in self._shafts:
            one.goal = None

    def _measure(self, now_s: float) -> tuple[Steps, Steps]:
        return self.positions_steps(), tuple([one.speed_steps_s for one in self._shafts])

    def _follow(self, goals_steps: Sequence[int]) -> tuple[int, ...]:
        """Move the shafts from their positions to goals; return the goals within the limits."""
        goals = super()._follow(goals_steps)
        for one, goal in zip(self._shafts, goals, strict=True):
            one.goal = goal
        return goals
