"""Examination of a camera: refused settings, frame rate and viewing conditions."""

import threading
from collections.abc import Callable
from contextlib import suppress
from time import perf_counter

from gazerig.drivers.camera.health import FIELD_TEXT, CameraHealth
from gazerig.drivers.camera.orientation import FrameOrientation, UprightSource
from gazerig.drivers.camera.params import ASSUMED_FIELD_DEG
from gazerig.drivers.camera.source import FrameSource
from gazerig.drivers.errors import SetupError
from gazerig.drivers.vision.face.detector import face_detector
from gazerig.drivers.vision.face.params import FaceDetectorParams
from gazerig.features.bringup.doctor.diagnostics import Diagnostic, Level
from gazerig.robot.model.frames import CameraParams

LOOK_S = 12.0
"""Duration of the examination: longer than a condition must last to be reported."""

_WHERE = "camera"
_PROBE_S = 1.0


def examine_camera(
    source: FrameSource,
    camera: CameraParams,
    faces: FaceDetectorParams,
    now_s: Callable[[], float],
    look_s: float = LOOK_S,
) -> list[Diagnostic]:
    """Watch the frames of a camera; return the problems, each with its remedy.

    Args:
        source: source of the frames.
        camera: orientation and lens.
        faces: parameters of the face detector.
        now_s: clock of the host.
        look_s: duration, by the times of the frames.
    """
    turned = UprightSource(source, FrameOrientation(camera.rotation, camera.mirrored))
    health, detector = CameraHealth(camera.rotation, _PROBE_S), face_detector(faces)
    assumed = camera.lens is None and camera.horizontal_field_deg == ASSUMED_FIELD_DEG
    told: list[str] = []
    conditions: tuple[str, ...] = ()
    frames = with_face = 0
    first_s = last_s = 0.0
    try:
        turned.open()
        while frames == 0 or last_s - first_s < look_s:
            shot = turned.take(now_s, threading.Event())
            if shot is None:
                break
            began_s = perf_counter()
            found = detector.find(shot.image)
            spent_s = {"faces": perf_counter() - began_s}
            conditions = health.assess(shot, found, spent_s, assumed and shot.lens is None)
            frames, with_face = frames + 1, with_face + bool(found)
            first_s, last_s = first_s if frames > 1 else shot.captured_s, shot.captured_s
            told += turned.events()
    except SetupError as error:
        return [Diagnostic("error", str(error), _WHERE)]
    finally:
        with suppress(SetupError):
            turned.close()
    what = f"{frames / max(1e-3, last_s - first_s):.0f} frames a second, faces in {with_face} of {frames}"
    findings = [Diagnostic("ok", what, _WHERE)]
    findings += [Diagnostic("note", line, _WHERE) for line in told]
    for text in conditions:
        fact, _, remedy = text.partition(": ")
        level: Level = "note" if text == FIELD_TEXT else "warn"
        findings.append(Diagnostic(level, fact, _WHERE, remedy))
    return findings
