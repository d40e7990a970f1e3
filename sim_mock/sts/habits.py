"""What STS servos do where documents and devices are silent or differ.

Sources: Feetech, memory table and communication protocol of the STS series; reports of
people who build arms with them. Defaults are the choice that is hardest on a client, where no
report decides; they and times marked [A] are assumed.
"""

from dataclasses import dataclass, replace
from typing import Literal, get_args

AfterMissing = Literal["silence", "skip", "timeout"]
BroadcastPing = Literal["answer", "mix", "silence"]
Goal = Literal["wait", "torque-on"]
TorqueOn = Literal["old-goal", "present"]
GoalTime = Literal["obey", "ignore"]
OverloadEnds = Literal["new-goal", "goal-away", "torque", "restart"]
Reboot = Literal["mute", "answer"]
WrongBaud = Literal["silence", "garbage"]


@dataclass(frozen=True)
class StsHabits:
    """The choices.

    after_missing: what servos do that come after a silent one in a sync read: never answer,
        answer at once, or answer after ``slot_timeout_s`` [A]
    broadcast_ping: all answer in the order of their ids, all at once (the bytes mix), or none
    goal: a goal position written without torque waits for it, or switches the torque on; the
        maker's own examples never switch it on and move all the same [R]
    torque_on: as the torque comes on the old goal is followed, or the goal becomes the present
        position
    goal_time: Goal Time (44) decides how long a move takes where it is not 0, or means nothing
    overload_ends: what ends the overload protection: a goal other than before, a goal that
        leads away from what it pushed against, none but torque off, or (all the others as
        well) a restart
    reboot: a reboot instruction is not answered, or is
    wrong_baud: a client at another baud rate hears nothing, or garbage
    packet_gap_s: a packet that stays unfinished so long is dropped [A]
    """

    after_missing: AfterMissing = "silence"
    broadcast_ping: BroadcastPing = "answer"
    goal: Goal = "wait"
    torque_on: TorqueOn = "old-goal"
    goal_time: GoalTime = "obey"
    overload_ends: OverloadEnds = "new-goal"
    reboot: Reboot = "mute"
    wrong_baud: WrongBaud = "silence"
    slot_timeout_s: float = 0.001
    packet_gap_s: float = 0.0015


_CHOICES: dict[str, tuple[str, ...]] = {
    "after_missing": get_args(AfterMissing),
    "broadcast_ping": get_args(BroadcastPing),
    "goal": get_args(Goal),
    "torque_on": get_args(TorqueOn),
    "goal_time": get_args(GoalTime),
    "overload_ends": get_args(OverloadEnds),
    "reboot": get_args(Reboot),
    "wrong_baud": get_args(WrongBaud),
}
_TIMES = {"slot_timeout_ms": "slot_timeout_s", "packet_gap_ms": "packet_gap_s"}


def cases() -> dict[str, str]:
    """Give the name of every case, as it is typed, and its possible values."""
    named = {name.replace("_", "-"): "|".join(values) for name, values in _CHOICES.items()}
    return named | {name.replace("_", "-"): "MS" for name in _TIMES} | {"baud": "heed|any"}


def chosen(habits: StsHabits, case: str, value: str) -> StsHabits:
    """Give the habits with one case decided otherwise.

    Raises:
        ValueError: there is no such case or value.
    """
    name = case.replace("-", "_")
    if name in _TIMES:
        time_s = _milliseconds(case, value) / 1000.0
        return replace(habits, **{_TIMES[name]: time_s})  # type: ignore[arg-type]
    if name not in _CHOICES:
        raise ValueError(f"set {case!r}: unknown; there is {', '.join(cases())}")
    if value not in _CHOICES[name]:
        raise ValueError(f"{case} {value!r}: it can be {', '.join(_CHOICES[name])}")
    return replace(habits, **{name: value})  # type: ignore[arg-type]


def _milliseconds(case: str, value: str) -> float:
    try:
        number = float(value)
    except ValueError:
        number = -1.0
    if not 0.0 <= number < 1e6:
        raise ValueError(f"{case} {value!r}: not a number of milliseconds of 0 or more")
    return number
