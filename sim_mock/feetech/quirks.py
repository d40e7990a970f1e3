"""Behaviour of Feetech servos where documents and devices are silent or differ.

Sources: Feetech, memory table and communication protocol of the STS series; reports of
people who build arms with them. Defaults are the choice that is hardest on a client, where no
report decides; they are assumed.
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
    """The choices.

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
    """

    broadcast_ping: BroadcastPing = "answer"
    goal: Goal = "wait"
    torque_on: TorqueOn = "old-goal"
    goal_time: GoalTime = "obey"
    overload_ends: OverloadEnds = "new-goal"
    reboot: Reboot = "mute"
