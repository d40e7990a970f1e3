"""Films of conditions: the head as seen by the person it looks at, rendered without a display.

The run is simulated with the condition's rig, or read from a recording. The head is the robot
description of the rig (gazerig.robot.description); the camera is fixed at the nose of the scene's
first person.
"""

import os
import secrets
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from gazerig.config.rig import Rig
from gazerig.drivers.camera.pinhole import Intrinsics
from gazerig.drivers.errors import SetupError
from gazerig.drivers.files.file_output import make_folder
from gazerig.drivers.files.film_writer import film_writer
from gazerig.drivers.types import ImageArray
from gazerig.features.lab.simulated_run import simulate
from gazerig.features.study.run.study_file import LoadedStudy
from gazerig.gaze.types import Vec3
from gazerig.robot.app.assemble import assemble
from gazerig.robot.app.options import RunOptions
from gazerig.robot.app.rig_description import description_of
from gazerig.robot.control.tick import Tick
from gazerig.robot.description.files import description_files
from gazerig.robot.model.types import order_joints
from gazerig.robot.recording.read import RunRecording, report_bad_contents

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

Progress = Callable[[float], None]
"""Receives the finished share, 0..1."""


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


def films(study: LoadedStudy, folder: Path, progress: Callable[[str], Progress]) -> dict[str, Path]:
    """Return the film of each condition; missing ones are rendered.

    The names of the files do not identify conditions; ``index.txt`` in the folder assigns them.

    Raises:
        SetupError: a film cannot be rendered or written.
    """
    make_folder(folder)
    index = folder / "index.txt"
    known = index.read_text(encoding="utf-8") if index.exists() else ""
    found = dict(line.split() for line in known.splitlines())
    for key, condition in study.design.conditions.items():
        if condition.film is not None:
            continue
        name = found.get(key, "")
        if not name or not (folder / name).exists():
            name = f"{secrets.token_hex(8)}.webm"
            render(study, key, folder / name, progress(key))
            found[key] = name
            index.write_text("".join(f"{a} {b}\n" for a, b in found.items()), encoding="utf-8")
    own = {key: one.film for key, one in study.design.conditions.items()}
    return {key: Path(film) if film else folder / found[key] for key, film in own.items()}


def render(study: LoadedStudy, key: str, path: Path, progress: Progress) -> None:
    """Write the film of a condition; an existing file is overwritten.

    Raises:
        SetupError: it cannot be rendered or written, or its run is not available.
    """
    seconds = study.design.trials.seconds
    rig = study.rigs[key]
    names = order_joints(rig.joints)
    seen = assemble(rig, _options(study, 1.0))
    try:
        people = () if seen.scene is None else seen.scene.people(0.0)
    finally:
        seen.close()
    # At the nose of the person the head looks at.
    pictures = HeadPictures(rig, people[0].p_world_face_m if people else VIEWER_M)
    made = path.with_name(f".{path.name}")
    try:
        with film_writer(made, (SIZE_PX, SIZE_PX), RATE_HZ) as write:
            begin_s, shown, next_s = None, 0, 0.0
            for tick in _ticks(study, key):
                begin_s = tick.t_s if begin_s is None else begin_s
                at_s = tick.t_s - begin_s
                if at_s < next_s - 1e-9 or next_s >= seconds - 1e-9:
                    continue
                write(pictures.draw(names, tick.joints.position_rad))
                shown += 1
                next_s = shown / RATE_HZ
                progress(min(1.0, next_s / seconds))
        if next_s < seconds - 1.0 / RATE_HZ:
            raise SetupError(
                f"{study.design.conditions[key].recording} lasts {next_s:.1f} s, and a "
                f"presentation {seconds:g} s: take trials.seconds: {int(next_s)}"
            )
        os.replace(made, path)
    finally:
        made.unlink(missing_ok=True)
        pictures.close()


def _ticks(study: LoadedStudy, key: str) -> Iterator[Tick]:
    """Yield the ticks of a film."""
    recording = study.design.conditions[key].recording
    if recording is not None:
        with report_bad_contents(Path(recording)):
            yield from RunRecording(recording).ticks()
        return
    seen = list[Tick]()
    seconds = SETTLES_S + study.design.trials.seconds
    simulate(study.rigs[key], _options(study, seconds), watch=seen.append)
    first_s = seen[0].t_s + SETTLES_S
    yield from (tick for tick in seen if tick.t_s >= first_s)


def _options(study: LoadedStudy, seconds: float) -> RunOptions:
    """Return the options of a film's simulated run."""
    shown = study.design.presentation
    return RunOptions(
        mock=True, fast=True, seed=shown.seed, scene=shown.scene, world=shown.world,
        no_pictures=shown.world is not None, seconds=seconds, no_page=True,
    ).check_and_complete()  # fmt: skip
