"""Weight of a head on the shafts of a chain; it depends on the positions of all of them.

Joints on other chains count as at 0, and linkages as linear.
"""

from collections.abc import Sequence
from typing import NamedTuple

from gazerig.robot.model.weight import MovingBody, weight_nm
from gazerig.sim_mock.smart_servo.physics import STEPS_PER_RAD


class TurnedJoints(NamedTuple):
    """Joints that a shaft turns.

    zero_steps: position of the shaft with these joints at 0, 4096 steps per turn
    rad_per_step: joints, and the angle of each per step of the shaft
    """

    zero_steps: float
    rad_per_step: Sequence[tuple[str, float]]


class HeadWeight(NamedTuple):
    """The bodies of a head, and the joints of each shaft of a chain in its order."""

    bodies: Sequence[MovingBody]
    shafts: Sequence[TurnedJoints]

    def loads_nm(self, steps: Sequence[float]) -> list[float]:
        """Return the torque on each shaft at these positions of all."""
        angles: dict[str, float] = {}
        for (zero, joints), at in zip(self.shafts, steps, strict=True):
            for joint, rate in joints:
                angles[joint] = angles.get(joint, 0.0) + rate * (at - zero)
        torques = weight_nm(self.bodies, angles)
        return [
            STEPS_PER_RAD * sum(rate * torques.get(joint, 0.0) for joint, rate in one.rad_per_step)
            for one in self.shafts
        ]
