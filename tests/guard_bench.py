"""A guard, and joints that follow its commands."""

from math import radians
from types import ModuleType
from typing import Any

from desk import GAZE_JOINTS
from msgspec.structs import replace

from gazerig.robot.model.guard_params import GuardParams
from gazerig.robot.model.joint import JointLimit
from gazerig.robot.model.types import JointState

DT = 0.005
YAW, PITCH, LID = 6, 7, 4
JOINT = YAW
TOP, ACCEL = radians(200), radians(1_500)
LOW, HIGH = radians(-60), radians(50)


class Bench:
    """One guard and joints that follow commands; every command is checked."""

    def __init__(self, m: ModuleType, start_deg: float = 0.0, gentle: bool = False, **params: Any):
        limit = JointLimit(LOW, HIGH, TOP, ACCEL, 70.0, 3.5, 7.0)
        self.guard = m.Guard(GuardParams(**params), (limit,) * 9, GAZE_JOINTS)
        self.guard.reset(0.0, (radians(start_deg),) * 9)
        if not gentle:
            self.guard._gentle = [False] * 9
        self.t_s = 0.0
        self.path = [(radians(start_deg),) * 9]
        self.speed: tuple[float, ...] = (0.0,) * 9
        self.why = ""
        self.level = ""

    def tick(self, desired: float | tuple[float, ...], age_s: float = 0.0, **said: Any) -> float:
        """One tick; said: a column for JOINT, or ``at`` and ``old_s`` for its position."""
        self.t_s += DT
        at, old_s = said.pop("at", None), said.pop("old_s", 0.0)
        position = tuple(
            at if k == JOINT and at is not None else p for k, p in enumerate(self.path[-1])
        )
        ages = tuple(self.t_s - (old_s if k == JOINT else 0.0) for k in range(9))
        usual = {"torque": True, "fault": "", "rearmed": False, "load": 0.0, "measured": True}
        usual |= {"temperature_c": 40.0, "voltage_v": 5.0}
        columns: dict[str, Any] = {
            name: tuple(one if k == JOINT else usual[name] for k in range(9))
            for name, one in said.items()
        }
        state = replace(JointState(position, (0.0,) * 9, ages, ()), **columns)
        wishes = (desired,) * 9 if isinstance(desired, float) else desired
        verdict = self.guard.check(wishes, state, age_s, self.t_s)
        before: tuple[float, ...] = self.path[-1]
        if said.get("rearmed"):
            assert at is not None
            before = tuple(at if k == JOINT else p for k, p in enumerate(before))
            self.speed = tuple(0.0 if k == JOINT else v for k, v in enumerate(self.speed))
        self.path.append(verdict.command_rad)
        self._within(before)
        self.why, self.level = verdict.applied(GAZE_JOINTS[JOINT]).reason, verdict.level
        return verdict.command_rad[JOINT]

    def _within(self, before: tuple[float, ...]) -> None:
        after = self.path[-1]
        speed = tuple((b - a) / DT for a, b in zip(before, after, strict=True))
        for p, v, v_before in zip(after, speed, self.speed, strict=True):
            assert LOW <= p <= HIGH, f"position {p}"
            assert abs(v) <= TOP + 1e-6, f"speed {v}"
            assert abs(v - v_before) <= ACCEL * DT + 1e-6, f"acceleration {(v - v_before) / DT}"
        self.speed = speed
