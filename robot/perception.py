"""Detections and the head's pose at their capture time to a percept in the world.

A face's landmarks give its metric pose in the camera frame; the camera is placed where
it was when the picture was taken, not where it is now.
"""

from collections.abc import Mapping
from math import radians

import numpy as np

from drivers.types import Detections
from gaze.angles import add, compose, rotate, scale, sub, unit
from gaze.types import PARTS, Bodies, Face, Mat3, Percept, Vec3
from robot.face_pose import PARTS_FACE_M, Intrinsics, face_pose, intrinsics_of_view
from robot.frames import CameraMount, PoseHistory
from robot.tracks import Sighting, Track, Tracker

_FACE_RADIUS_M = 0.1


class Perception:
    """Sees: one percept for each new picture."""

    def __init__(
        self,
        mount: CameraMount,
        horizontal_field_deg: float,
        tracker: Tracker,
        parts_face_m: Mapping[str, Vec3] | None = None,
    ) -> None:
        """Take where the camera sits, its field of view and the tracker.

        parts_face_m: a person's own places of some parts in the face's frame, instead of
            the canonical ones (Nakamoto & Tsuruno 3.7)
        """
        own = parts_face_m or {}
        # A measured part is where it was measured; a canonical one is stretched with the face.
        self._parts = tuple((own.get(code, PARTS_FACE_M[code]), code in own) for code in PARTS)
        self._mount = mount
        self._field_rad = radians(horizontal_field_deg)
        self._size_px = (0, 0)
        self._tracker = tracker
        self._intrinsics: Intrinsics | None = None
        self._percept: Percept | None = None
        self._number = 0
        self.pictures = 0
        self.pictures_with_face = 0

    def see(self, detections: Detections | None, poses: PoseHistory) -> Percept | None:
        """Give the percept of the newest picture, None before the first."""
        if detections is None or detections.number == self._number:
            return self._percept
        self._number = detections.number
        self.pictures += 1
        self.pictures_with_face += bool(detections.faces)
        t_s = detections.captured_s
        R, p = self._mount.pose(*poses.head_pose(t_s))
        tracks = self._tracker.step(self._sightings(detections, R, p), p, t_s)
        self._percept = Percept(
            t_s,
            _bodies(tracks, p),
            tuple(self._face(track) for track in tracks if track.sighting.kind == "face"),
        )
        return self._percept

    def _sightings(self, found: Detections, R_world_camera: Mat3, p: Vec3) -> list[Sighting]:
        """Place everything found in the world."""
        intrinsics = self._lens(found.width_px, found.height_px)
        sightings = []
        for face in found.faces:
            pose = face_pose(face.landmarks_px, intrinsics)
            if pose is None:
                continue
            sightings.append(
                Sighting(
                    "face",
                    add(p, rotate(R_world_camera, pose.p_camera_m)),
                    compose(R_world_camera, pose.R_camera_face),
                    _FACE_RADIUS_M,
                    0.0,
                    face.confidence,
                    pose.length,
                )
            )
        for blob in found.blobs:
            place = add(p, rotate(R_world_camera, blob.p_camera_m))
            sightings.append(
                Sighting(
                    blob.kind,
                    place,
                    None,
                    blob.radius_m,
                    blob.spin_rad_s,
                    1.0,
                    depth_measured=True,
                )
            )
        return sightings

    def _face(self, track: Track) -> Face:
        """Give a tracked face with its eight parts."""
        R = track.R_world_face
        assert R is not None  # faces are tracked with their pose
        p = track.p_world_m
        parts = ((x, y, z if own else z * track.face_length) for (x, y, z), own in self._parts)
        return Face(
            track.id,
            p,
            track.v_world_m_s,
            R,
            tuple(add(p, rotate(R, part)) for part in parts),
            track.sighting.confidence,
        )

    def _lens(self, width_px: int, height_px: int) -> Intrinsics:
        """Give the intrinsics for a size of picture, made anew when the size changes."""
        if self._size_px != (width_px, height_px) or self._intrinsics is None:
            self._size_px = (width_px, height_px)
            self._intrinsics = intrinsics_of_view(self._field_rad, width_px, height_px)
        return self._intrinsics


def _bodies(tracks: tuple[Track, ...], p_camera: Vec3) -> Bodies:
    """List faces and moving things alike; a spin seen in the picture is about the view line."""
    spins = [
        scale(unit(sub(track.p_world_m, p_camera)), track.sighting.spin_rad_s) for track in tracks
    ]
    return Bodies(
        tuple(track.id for track in tracks),
        tuple(track.sighting.kind for track in tracks),
        np.array([track.p_world_m for track in tracks]).reshape(-1, 3),
        np.array([track.v_world_m_s for track in tracks]).reshape(-1, 3),
        np.array(spins).reshape(-1, 3),
        np.array([track.sighting.radius_m for track in tracks]),
    )
