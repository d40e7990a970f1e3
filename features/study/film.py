"""Films of conditions: the head as seen by the person it looks at, rendered without a display.

The run is simulated with the condition's rig. The head is the robot description of the rig
(gazerig.robot.description); the camera is fixed at the nose of the scene's first person.
"""

import os
from collections.abc import Callable
from hashlib import sha256
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from gazerig.config.parameters import values
from gazerig.config.rig import Rig
from gazerig.drivers.camera.pinhole import Intrinsics
from gazerig.drivers.errors import SetupError
from gazerig.drivers.files.file_output import make_folder
from gazerig.drivers.files.film_writer import film_writer
from gazerig.drivers.types import ImageArray
from gazerig.features.lab.simulated_run import simulate
from gazerig.features.study.study_file import Study
from gazerig.gaze.types import Vec3
from gazerig.robot.app.assemble import assemble
from gazerig.robot.app.options import RunOptions
from gazerig.robot.app.rig_description import description_of
from gazerig.robot.control.tick import Tick
from gazerig.robot.description.files import description_files
from gazerig.robot.model.types import order_joints

SIZE_PX, RATE_HZ = 720, 25.0
SETTLES_S = 3.0
"""Time of a simulated run before its film, in which the head finds the person, seconds."""
VIEWER_M: Vec3 = (1.0, 0.0, 0.25)
"""Position of the camera for a head that looks at no one."""
_HEAD_M, _HEAD_SHARE = 0.24, 0.8
"""Height of a head, and its share of the picture's height."""
_BELOW_EYES_M = 0.02
"""Distance of the picture's centre below the eyes."""
_SAMPLES, _SHADOW_PX = 4, 0  # at this distance shadows would speckle the skin


class HeadPictures:
    """Pictures of a rig's head from one position.

    Args:
        rig: the rig.
        p_viewer_m: position of the viewer, world frame of the rig.

    Raises:
        SetupError: the feature world or MuJoCo is missing, or rendering is impossible here.
    """

    def __init__(self, rig: Rig, p_viewer_m: Vec3) -> None:
        try:
            from gazerig.features.world.gl_context import import_mujoco
        except ModuleNotFoundError as error:
            raise SetupError(f"films are rendered by the feature world: {error}") from error
        mujoco: Any = import_mujoco()
        from gazerig.features.world.renderer import Renderer, RendererParams

        self._description = description_of(rig)
        files = description_files(self._description, ["mjcf"])
        scene = files.pop("scene.xml").decode()
        self._mujoco = mujoco
        self._model = mujoco.MjModel.from_xml_string(scene, files)
        self._data = mujoco.MjData(self._model)
        params = RendererParams(_SHADOW_PX, _SAMPLES)
        self._renderer = Renderer(self._model, SIZE_PX, SIZE_PX, params)
        shape = rig.geometry
        up_mm = shape.pitch_axis_height_mm + shape.eyes_above_mm
        middle = np.array([0.001 * shape.eyes_ahead_mm, 0.0, 0.001 * up_mm - _BELOW_EYES_M])
        # Optical axes of a camera that looks at the middle of the face.
        self._p_m = np.array(p_viewer_m)
        ahead = middle - self._p_m
        away_m = float(np.linalg.norm(ahead))
        ahead /= away_m
        right = np.cross(ahead, (0.0, 0.0, 1.0))
        right /= np.linalg.norm(right)
        self._R = np.column_stack((right, np.cross(ahead, right), ahead))
        focal_px = _HEAD_SHARE * SIZE_PX * away_m / _HEAD_M
        self._lens = Intrinsics(focal_px, focal_px, 0.5 * (SIZE_PX - 1), 0.5 * (SIZE_PX - 1))

    def draw(self, names: tuple[str, ...], position_rad: tuple[float, ...]) -> ImageArray:
        """Return a BGR picture with the joints at these angles."""
        for name, angle in self._description.angles(names, position_rad).items():
            self._data.qpos[self._model.joint(name).qposadr[0]] = angle
        self._mujoco.mj_forward(self._model, self._data)
        return self._renderer.render(self._data, self._lens, self._R, self._p_m).image

    def close(self) -> None:
        """Free the renderer."""
        self._renderer.close()


def films(study: Study, folder: Path, progress: Callable[[str, float], object]) -> dict[str, Path]:
    """Return the film of each condition; missing ones are rendered.

    The names of the files are hashes of what they show.

    Raises:
        SetupError: a film cannot be rendered or written.
    """
    make_folder(folder)
    found: dict[str, Path] = {}
    for key, condition in study.design.conditions.items():
        if condition.film is not None:
            found[key] = Path(study.locate(condition.film))
            continue
        shown = [study.design.presentation, study.design.trials.seconds, values(study.rigs[key])]
        name = sha256(msgspec.json.encode(shown, enc_hook=str)).hexdigest()[:16]
        found[key] = folder / f"{name}.webm"
        if not found[key].exists():
            _render(study, key, found[key], progress)
    return found


def _render(study: Study, key: str, path: Path, progress: Callable[[str, float], object]) -> None:
    """Write the film of a condition."""
    rig, seconds = study.rigs[key], study.design.trials.seconds
    shown = study.design.presentation
    options = RunOptions(
        mock=True, fast=True, seed=shown.seed, scene=shown.scene, seconds=SETTLES_S + seconds,
        no_page=True,
    ).check_and_complete()  # fmt: skip
    assembly = assemble(rig, options)
    people = () if assembly.scene is None else assembly.scene.people(0.0)
    assembly.close()
    ticks = list[Tick]()
    simulate(rig, options, watch=ticks.append)
    first_s = ticks[0].t_s + SETTLES_S
    names = order_joints(rig.joints)
    # At the nose of the person the head looks at.
    pictures = HeadPictures(rig, people[0].p_world_face_m if people else VIEWER_M)
    partial = path.with_name(f".{path.name}")
    try:
        with film_writer(partial, (SIZE_PX, SIZE_PX), RATE_HZ) as write:
            count = 0
            for tick in ticks:
                at_s = count / RATE_HZ - 1e-9
                if tick.t_s - first_s >= at_s and at_s < seconds - 1e-6:
                    write(pictures.draw(names, tick.joints.position_rad))
                    count += 1
                    progress(f"film of {key}", at_s / seconds)
        os.replace(partial, path)
    finally:
        partial.unlink(missing_ok=True)
        pictures.close()
