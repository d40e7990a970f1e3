"""Draw docs/figures/describe.png: MUJOCO_GL=egl python docs/figures/make_describe_picture.py."""

from math import radians
from pathlib import Path

import cv2
import mujoco
import numpy as np

from gazerig.config.schema import load_rig
from gazerig.robot.description.export import scene_files
from gazerig.robot.run.rig_description import description_of

PICTURE = Path(__file__).parent / "describe.png"
_SIZE = (520, 640)
_POSES = {
    "desk": {"left_upper_lid": 16.9, "right_upper_lid": 16.9, "neck_yaw": -8.0},
    "expressive": {
        "left_upper_lid": 20.0, "right_upper_lid": 20.0, "jaw": 14.0, "left_brow": 12.0,
        "right_brow": 12.0, "neck_yaw": 14.0, "eyes_pan": -12.0,
    },
}  # fmt: skip
"""Angles in degrees of the joints that are not at 0."""


def _picture(rig: str, bodies: bool) -> np.ndarray:
    """Return a picture of a rig on its table, red first; ``bodies``: its collision shapes."""
    description = description_of(load_rig(rig))
    files = scene_files(description)
    text = files.pop("scene.xml").decode()
    text = text.replace('offwidth="1280" offheight="960"', 'offwidth="1560" offheight="1920"')
    model = mujoco.MjModel.from_xml_string(text, files)
    data = mujoco.MjData(model)
    names = _POSES[rig]
    pose = description.angles(tuple(names), [radians(angle) for angle in names.values()])
    for name, angle in pose.items():
        data.qpos[model.joint(name).qposadr[0]] = angle
    mujoco.mj_forward(model, data)
    camera = mujoco.MjvCamera()
    camera.lookat[:] = (-0.02, 0.0, 0.105)
    camera.distance, camera.azimuth, camera.elevation = 0.58, 158.0, -6.0
    options = mujoco.MjvOption()
    options.geomgroup[2], options.geomgroup[3] = not bodies, bodies
    # Twice as large and made smaller, which smooths its edges.
    with mujoco.Renderer(model, 2 * _SIZE[1], 2 * _SIZE[0]) as renderer:
        renderer.update_scene(data, camera, options)
        return cv2.resize(renderer.render(), _SIZE, interpolation=cv2.INTER_AREA)


def main() -> None:
    """Write the picture."""
    pictures = [_picture("desk", False), _picture("expressive", False), _picture("desk", True)]
    cv2.imwrite(str(PICTURE), cv2.cvtColor(np.hstack(pictures), cv2.COLOR_RGB2BGR))
    print(f"written: {PICTURE}")


if __name__ == "__main__":
    main()
