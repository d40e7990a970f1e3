"""Behaviour of Feetech servos that is undocumented or differs between documents and devices.

Sources: Feetech, memory table and communication protocol of the STS series; reports of people who
build arms with them. If no report decides, the default is the choice that is hardest on a client,
and is assumed.
"""

from dataclasses import dataclass
from typing import Literal

from gazerig.sim_mock.smart_servo.quirks import ChainQuirks

BroadcastPing = Literal["answer", "mix", "silence"]
Goal = Literal["wait", "torque-on"]
TorqueOn = Literal["old-goal", "present"]
GoalTime = Literal["obey", "ignore"]
OverloadEnds = Literal["new-goal", "goal-away", "torque", "restart"]
Reboot = Literal["mute", "answer"]


@dataclass(frozen=True, kw_only=True)
class FeetechQuirks(ChainQuirks):
    """Choices of behaviour.

    broadcast_ping: all answer in the order of their ids, all at the same time (the bytes mix), or
        none
    goal: a goal position written without torque waits for it, or switches the torque on; the
        maker's own examples never switch it on and move all the same [R]
    torque_on: when the torque is switched on, the servo follows the old goal, or the goal becomes
        the present position
    goal_time: Goal Time (44) sets the duration of a move unless it is 0, or has no effect
    overload_ends: the overload protection ends with a different goal, with a goal away from the
        obstacle, only with torque off, or (in addition to all of these) with a restart
    reboot: a reboot instruction is not answered, or is
    """

    broadcast_ping: BroadcastPing = "answer"
    goal: Goal = "wait"
    torque_on: TorqueOn = "old-goal"
    goal_time: GoalTime = "obey"
    overload_ends: OverloadEnds = "new-goal"
    reboot: Reboot = "mute"
