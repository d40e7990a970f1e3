"""JSON files of Blender's add-on Servo Animation: servo positions for each frame.

Source: github.com/timhendriks93/blender-servo-animation, addon/ops/json_export.py: fps, frames,
and by servo id the name of the bone and one whole number per frame, in the unit of the servo.
"""

from pathlib import Path

import numpy as np
from msgspec import Struct

from gazerig.config.rig import Rig
from gazerig.drivers.errors import SetupError
from gazerig.features.animation.animation import (
    ImportedAnimation,
    JointMap,
    Series,
    check_count,
    check_keys,
    decode,
)
from gazerig.gaze.types import Floats


class _ServoCurve(Struct):
    name: str
    positions: list[float]


class _File(Struct):
    fps: float
    servos: dict[str, _ServoCurve]


def read(
    path: Path, data: bytes, rig: Rig, names: JointMap, centre_deg: float | None
) -> ImportedAnimation:
    """Return the animation of a file.

    Args:
        path: path of the file, for messages.
        data: its content.
        rig: rig whose servos have these positions.
        names: joints by the names of the bones.
        centre_deg: position straight ahead, if positions are degrees; None: they are in the unit
            of the rig's servos, steps or us.

    Raises:
        SetupError: the file is invalid, or a bone is no joint.
    """
    file = decode(path, data, _File, "a file of Blender's add-on Servo Animation 2")
    if not 1.0 <= file.fps <= 1000.0:
        raise SetupError(f"{path}: fps is {file.fps:g}; it must be within 1 and 1000")
    check_count(str(path), sum(len(servo.positions) for servo in file.servos.values()))
    series: dict[str, Series] = {}
    for key, servo in file.servos.items():
        where = f"{path}: servos.{key}: "
        joint, sign = names.require(where, servo.name)
        positions = np.array(servo.positions)
        times = np.arange(len(positions)) / file.fps
        check_keys(f"{where}{servo.name}", times, positions)
        if centre_deg is None:
            angles = _angles_deg(path, rig, joint, positions)
        else:
            angles = positions - centre_deg
        series[joint] = times, sign * angles
    return ImportedAnimation(series)


def _angles_deg(path: Path, rig: Rig, joint: str, positions: Floats) -> Floats:
    """Return the joint's angles at servo positions, by its zero, sign, ratio or push rod."""
    if any(joint in (one.first, one.second) for one in rig.couplings.values()):
        raise SetupError(
            f"{path}: {joint} is moved by two servos together: export degrees of the joint, and "
            "add --degrees CENTRE"
        )
    params = rig.joints[joint]
    linkage, unit = params.make_linkage(), params.model_facts.unit_steps
    values, index = np.unique(positions, return_inverse=True)
    angles = np.degrees([linkage.angle_rad(unit * one) for one in values.tolist()])
    return np.asarray(angles[index])
