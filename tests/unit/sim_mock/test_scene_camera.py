"""The camera on a scene: things come late, noisy, with their identity, inside the field."""

from typing import Any

import numpy as np
import pytest
from fakes.scenes import EmptyScene
from present import present
from reviewed import assert_reviewed

from gazerig.drivers.types import Detections
from gazerig.gaze.types import Vec3
from gazerig.robot.model.frames import CameraMount, CameraParams
from gazerig.robot.run.surroundings import load_scene
from gazerig.sim_mock.cameras.detections import SceneCamera
from gazerig.sim_mock.cameras.frame_times import FrameParams
from gazerig.sim_mock.scenes.scene import Scene, ScenePerson, Thing

LEVEL = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


class Still(EmptyScene):
    """A scene that shows what it is given, and some of it only later."""

    def __init__(self, things: tuple[Thing, ...], later: tuple[Thing, ...] = ()) -> None:
        self._things, self._later = things, later

    def people(self, t_s: float) -> tuple[ScenePerson, ...]:
        return (ScenePerson((1.0, 0.0, 0.0), (np.pi, 0.0), (0.8, 0.2, 0.0)),)

    def things(self, t_s: float) -> tuple[Thing, ...]:
        return self._things if t_s < 0.5 else self._later + self._things


def camera(scene: Scene, **params: Any) -> SceneCamera:
    still = CameraMount(CameraParams(position_mm=(0.0, 0.0, 0.0)))
    made = SceneCamera(FrameParams(**params), scene, still, where, np.random.default_rng(0))
    made.open()
    return made


def where(_: float) -> tuple[tuple[Vec3, Vec3, Vec3], Vec3]:
    return LEVEL, (0.0, 0.0, 0.0)


def seen_at(made: SceneCamera, t_s: float) -> Detections:
    for now_s in np.arange(0.0, t_s + 1e-9, 0.005).tolist():
        found = made.latest(now_s)
    assert found is not None
    return found


@pytest.mark.parametrize("name", ["boxing", "three-people", "table"])
def test_every_detection_is_as_it_was_reviewed(name):
    rows, made = [], camera(load_scene(name))
    for now_s in np.arange(0.0, 30.0, 0.7).tolist():
        if found := made.latest(now_s):
            for face in found.faces:
                mouth = present(face.signs).mouth_opening_m
                rows.append([now_s, *face.box_px, *face.landmarks_px.flat, 1e3 * mouth])
            for blob in found.blobs:
                rows.append([now_s, blob.id, *blob.p_camera_m, blob.radius_m, blob.spin_rad_s])
    assert_reviewed(f"seen-{name}", rows)


def test_a_thing_is_seen_late_and_only_inside_the_field():
    aside = Thing(0, "hand", (0.5, 0.5, 0.0), 0.05)
    behind = Thing(1, "hand", (-0.5, 0.0, 0.0), 0.05)
    appears = Thing(2, "thing", (0.9, 0.0, 0.0), 0.05)
    made = camera(Still((aside, behind), later=(appears,)))
    assert all(blob.kind == "hand" for blob in seen_at(made, 0.55).blobs)
    assert len(seen_at(camera(Still((aside, behind))), 0.55).blobs) == 1  # the person's own hand
    shown = seen_at(camera(Still((), later=(appears,)), latency_ms=60.0), 0.63)
    assert "thing" in {blob.kind for blob in shown.blobs}


@pytest.mark.parametrize(
    ("aside_deg", "radius_m", "seen"), [(37.0, 0.07, 1), (37.0, 0.02, 0), (39.0, 0.07, 0)]
)
def test_a_hand_is_seen_while_a_part_of_it_is_in_the_picture(aside_deg, radius_m, seen):
    aside = Thing(0, "hand", (0.5, 0.5 * np.tan(np.radians(aside_deg)), 0.0), radius_m)
    made = camera(Still((aside,)), horizontal_field_deg=69.0)
    assert len(seen_at(made, 0.2).blobs) == 1 + seen  # and the person's own hand
