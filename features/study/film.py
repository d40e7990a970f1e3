"""Films of conditions: the head as seen by the person it looks at, rendered without a display.

The run is simulated with the condition's rig, whose robot description is the head.
"""

import os
from collections.abc import Callable
from hashlib import sha256
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from gazerig.config.parameters import values
from gazerig.drivers.camera.pinhole import Intrinsics
from gazerig.drivers.errors import SetupError
from gazerig.drivers.files.file_output import make_folder
from gazerig.features.lab.film_writer import film_writer
from gazerig.features.lab.simulated_run import simulate
from gazerig.features.study.design import SEED, Study
from gazerig.gaze.types import Vec3
from gazerig.robot.description.export import scene_files
from gazerig.robot.loop.tick import Tick
from gazerig.robot.model.types import order_joints
from gazerig.robot.run.options import RunOptions
from gazerig.robot.run.rig_description import description_of
from gazerig.robot.run.surroundings import load_scene

SIZE_PX, RATE_HZ = 720, 25.0
# Time of a simulated run before its film, in which the head finds the person, seconds.
_SETTLES_S = 3.0
# Position of the camera for a head that looks at no one.
_VIEWER_M: Vec3 = (1.0, 0.0, 0.25)
# Height of a head, its share of the picture's height, and the picture's centre below the eyes.
_HEAD_M, _HEAD_SHARE, _BELOW_EYES_M = 0.24, 0.8, 0.02
_SAMPLES, _SHADOW_PX = 4, 0  # at this distance shadows would speckle the skin


def films(study: Study, folder: Path, progress: Callable[[str, float], object]) -> dict[str, Path]:
    """Return the film of each condition; missing ones are rendered.

    The names of the files are hashes of what they show.

    Raises:
        SetupError: a film cannot be rendered or written.
    """
    make_folder(folder)
    found: dict[str, Path] = {}
    for key in study.design.conditions:
        shown = [study.design.presentation, study.design.trials.seconds, values(study.rigs[key])]
        name = sha256(msgspec.json.encode(shown, enc_hook=str)).hexdigest()[:16]
        found[key] = folder / f"{name}.webm"
        if not found[key].exists():
            _render(study, key, found[key], progress)
    return found


def _render(study: Study, key: str, path: Path, progress: Callable[[str, float], object]) -> None:
    try:
        from gazerig.features.world.gl_context import import_mujoco
    except ModuleNotFoundError as error:
        raise SetupError(f"films are rendered by the feature world: {error}") from error
    mujoco: Any = import_mujoco()
    from gazerig.features.world.renderer import Renderer, RendererParams

    rig, seconds = study.rigs[key], study.design.trials.seconds
    shown = study.design.presentation
    options = RunOptions(
        mock=True, fast=True, seed=SEED, scene=shown.scene, seconds=_SETTLES_S + seconds,
        no_page=True,
    ).check_and_complete()  # fmt: skip
    ticks = list[Tick]()
    simulate(rig, options, watch=ticks.append)
    description = description_of(rig)
    files = scene_files(description)
    model = mujoco.MjModel.from_xml_string(files.pop("scene.xml").decode(), files)
    data = mujoco.MjData(model)
    renderer = Renderer(model, SIZE_PX, SIZE_PX, RendererParams(_SHADOW_PX, _SAMPLES))
    # At the nose of the person the head looks at, with optical axes, to the middle of the face.
    people = load_scene(shown.scene, SEED).people(0.0) if shown.scene else ()
    p_m = np.array(people[0].p_world_face_m if people else _VIEWER_M)
    shape = rig.geometry
    up_m = 0.001 * (shape.pitch_axis_height_mm + shape.eyes_above_mm) - _BELOW_EYES_M
    ahead = np.array([0.001 * shape.eyes_ahead_mm, 0.0, up_m]) - p_m
    away_m = float(np.linalg.norm(ahead))
    right = np.cross(ahead, (0.0, 0.0, 1.0))
    axes = np.column_stack([right, np.cross(ahead, right), ahead])
    R = axes / np.linalg.norm(axes, axis=0)
    focal_px, middle_px = _HEAD_SHARE * SIZE_PX * away_m / _HEAD_M, 0.5 * (SIZE_PX - 1)
    lens = Intrinsics(focal_px, focal_px, middle_px, middle_px)
    pictures_s = ticks[0].t_s + _SETTLES_S + np.arange(round(seconds * RATE_HZ)) / RATE_HZ
    names, partial = order_joints(rig.joints), path.with_name(f".{path.name}")
    with film_writer(partial, (SIZE_PX, SIZE_PX), RATE_HZ) as write:
        for i in np.searchsorted([tick.t_s for tick in ticks], pictures_s - 1e-9):
            angles = description.angles(names, ticks[i].joints.position_rad)
            for name, angle in angles.items():
                data.qpos[model.joint(name).qposadr[0]] = angle
            mujoco.mj_forward(model, data)
            write(renderer.render(data, lens, R, p_m))
            progress(f"film of {key}", i / len(ticks))
    os.replace(partial, path)
