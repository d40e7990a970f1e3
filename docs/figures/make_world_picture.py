"""Draw world-people.webp, a moment of four worlds: python docs/figures/make_world_picture.py."""

import sys
from pathlib import Path
from typing import NamedTuple

sys.path.insert(0, str(Path(__file__).parents[2] / "tests" / "helpers"))

import cv2
import numpy as np
from PIL import Image
from world_scripts import shipped_world

from gazerig.config.schema import load_rig
from gazerig.drivers.camera.pinhole import intrinsics_of_view
from gazerig.features.world.gl_context import import_mujoco

import_mujoco()

import mujoco  # noqa: E402
from world_rigs import rig_in_world  # noqa: E402

from gazerig.features.world.figure import Figures  # noqa: E402
from gazerig.features.world.figure_model import PeoplePlacer  # noqa: E402
from gazerig.features.world.model import world_model  # noqa: E402
from gazerig.features.world.renderer import Renderer, RendererParams  # noqa: E402

PICTURE = Path(__file__).parent / "world-people.webp"
_SIZE = (480, 320)
_GAP = 6


class Moment(NamedTuple):
    """A time of a world, and from where to where it is seen: metres, degrees."""

    world: str
    t_s: float
    from_m: tuple[float, float, float]
    to_m: tuple[float, float, float]
    across_deg: float
    neck: dict[str, float]


MOMENTS = (
    Moment(
        "living-room", 15.2, (0.30, -1.30, 0.42), (0.58, 0.25, 0.02), 62.0, {"rig_neck_yaw": 0.3}
    ),
    Moment("conversation", 27.8, (-0.95, 0.0, 0.50), (1.2, 0.0, 0.05), 60.0, {}),
    Moment("boxing", 2.56, (0.45, -1.75, 0.25), (0.55, 0.2, 0.02), 54.0, {}),
    Moment("crowd", 36.4, (-0.80, 0.75, 0.62), (1.2, -0.12, -0.10), 62.0, {}),
)


def _looking(from_m: np.ndarray, to_m: np.ndarray) -> np.ndarray:
    """Return the rotation of a camera that looks at a point: its axes right, down, ahead."""
    ahead = (to_m - from_m) / np.linalg.norm(to_m - from_m)
    right = np.cross(ahead, (0.0, 0.0, 1.0))
    right /= np.linalg.norm(right)
    return np.stack((right, np.cross(ahead, right), ahead), axis=1)


def _picture(moment: Moment) -> np.ndarray:
    figures = Figures(shipped_world(moment.world), 1)
    model = world_model(figures, rig_in_world(load_rig("desk"))).mj
    data = mujoco.MjData(model)
    for joint, angle in moment.neck.items():
        data.qpos[model.joint(joint).qposadr[0]] = angle
    PeoplePlacer(model, figures).place(data, moment.t_s)
    mujoco.mj_forward(model, data)
    width, height = (2 * one for one in _SIZE)
    renderer = Renderer(model, width, height, RendererParams(shadow_px=0, samples=8))
    lens = intrinsics_of_view(np.radians(moment.across_deg), width, height)
    from_m = np.array(moment.from_m)
    seen = renderer.render(data, lens, _looking(from_m, np.array(moment.to_m)), from_m)
    renderer.close()
    return cv2.resize(seen[:, :, ::-1], _SIZE, interpolation=cv2.INTER_AREA)


def main() -> None:
    """Write the picture."""
    found = [_picture(one) for one in MOMENTS]
    wide = np.full((_SIZE[1], _GAP, 3), 255, np.uint8)
    rows = [np.hstack((a, wide, b)) for a, b in (found[:2], found[2:])]
    high = np.full((_GAP, rows[0].shape[1], 3), 255, np.uint8)
    Image.fromarray(np.vstack((rows[0], high, rows[1]))).save(PICTURE, quality=82, method=6)
    print(f"written: {PICTURE}, {PICTURE.stat().st_size / 1e3:.0f} kB")


if __name__ == "__main__":
    main()
