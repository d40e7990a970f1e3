"""What STS servos do where documents and devices are silent or differ.

Sources: Feetech, memory table and communication protocol of the STS series; reports of
people who build arms with them. Defaults are the choice that is hardest on a client, where no
report decides; they and times marked [A] are assumed.
"""

from dataclasses import dataclass
from typing import Literal, get_args

from sim_mock.smart_servo.quirks import cases_of, decided

AfterMissing = Literal["silence", "skip", "timeout"]
BroadcastPing = Literal["answer", "mix", "silence"]
Goal = Literal["wait", "torque-on"]
TorqueOn = Literal["old-goal", "present"]
GoalTime = Literal["obey", "ignore"]
OverloadEnds = Literal["new-goal", "goal-away", "torque", "restart"]
Reboot = Literal["mute", "answer"]
WrongBaud = Literal["silence", "garbage"]


@dataclass(frozen=True)
class FeetechQuirks:
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


def cases() -> dict[str, str]:
    """Give the name of every case, as it is typed, and its possible values."""
    return cases_of(_CHOICES)


def chosen(quirks: FeetechQuirks, case: str, value: str) -> FeetechQuirks:
    """Give the quirks with one case decided otherwise.

    Raises:
        ValueError: there is no such case or value.
    """
    return decided(quirks, _CHOICES, case, value)
