"""Play between the servos and the joints of a world, as in the emulated servos.

MuJoCo moves a joint together with its shaft. When the shaft reverses, a joint with play does not
move until the play is taken up; weight and inertia always act on both.
"""

from collections.abc import Mapping
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray


class JointPlay:
    """Joints of a world that lag behind their shafts by their play.

    Args:
        mj: the compiled model.
        data: its state.
        lead_rad: angle of each joint's shaft beyond the joint, by the index of its position,
            shape (nq,); kept up to date.
        half_rad: half of the play of each joint, by the same index.
    """

    def __init__(
        self, mj: Any, data: Any, lead_rad: NDArray[np.float64], half_rad: Mapping[int, float]
    ) -> None:
        self._qpos, self._all = data.qpos, lead_rad
        self._at = np.array(sorted(half_rad), dtype=np.intp)
        self._half = np.array([half_rad[at] for at in self._at.tolist()])
        self._lead = lead_rad[self._at]
        self._before = self._qpos[self._at]
        # Joints that an equality ties to one of these stay behind with it.
        followers = [
            (int(mj.jnt_qposadr[one]), self._at.tolist().index(leader), float(ratio))
            for kind, one, other, ratio in zip(
                mj.eq_type, mj.eq_obj1id, mj.eq_obj2id, mj.eq_data[:, 1], strict=True
            )
            if kind == mujoco.mjtEq.mjEQ_JOINT
            and other >= 0
            and (leader := int(mj.jnt_qposadr[other])) in half_rad
        ]
        self._followers = np.array([one[0] for one in followers], dtype=np.intp)
        self._leaders = np.array([one[1] for one in followers], dtype=np.intp)
        self._ratios = np.array([one[2] for one in followers])

    def begin(self) -> None:
        """Store the positions before a step of the world."""
        self._before = self._qpos[self._at]

    def hold(self) -> None:
        """Hold back the joints after a step of the world."""
        qpos, at, half = self._qpos, self._at, self._half
        lead = self._lead + qpos[at] - self._before
        np.clip(lead, -half, half, out=lead)
        back = self._lead - lead
        qpos[at] += back
        if len(self._followers):
            qpos[self._followers] += self._ratios * back[self._leaders]
        self._lead = self._all[at] = lead
