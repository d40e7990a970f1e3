"""Perception: a percept in the world, from detections and the head's pose at their capture.

Faces and moving things are localised in the world with the camera's pose at the exposure, not with
its present pose. Motion of a person's own body is separated from that of other things
(hand_ownership). A tracker assigns identities and velocities.
"""

from collections.abc import Callable, Mapping
from math import cos, hypot, radians, sqrt

import numpy as np

from gazerig.drivers.camera.depth_roi import depth_at
from gazerig.drivers.camera.pinhole import Intrinsics
from gazerig.drivers.types import SCENES_OF_A_PROCESS, Detections, Located
from gazerig.gaze.angles import (
    add,
    angle_between,
    dot,
    norm,
    rotate,
    rotate_back,
    scale,
    sub,
    transpose,
    unit,
)
from gazerig.gaze.types import PARTS, Bodies, Face, Percept, Vec3, vec
from gazerig.robot.model.face_geometry import PARTS_FACE_M
from gazerig.robot.model.frames import CameraMount, CameraParams, LensParams, PoseHistory
from gazerig.robot.model.intrinsics import intrinsics_of_lens, project, rays
from gazerig.robot.perception.face_pose import EYES_SHUT
from gazerig.robot.perception.frame_locator import SIZE_SPREAD, FrameLocator
from gazerig.robot.perception.hands import (
    Hands,
    known_faces,
    without_own_motion,
)
from gazerig.robot.perception.track import (
    EYES_HELD_S,
    UNNAMED,
    BodyTrack,
    looks_at_head,
    place_in_world,
)
from gazerig.robot.perception.tracker import Tracker, correct_velocity

# A camera that turned farther than this between two frames shows another part of the same room.
_COS_SAME_VIEW = cos(radians(5.0))
# A ball in flight comes faster than this; a hand that carries something past the camera does not.
_COMES_M_S = 1.0


class Perception:
    """Creates one percept of each new frame.

    Args:
        mount: position and orientation of the camera.
        horizontal_field_deg: field of view of the camera.
        parts_face_m: measured positions of one person's face parts in the face frame, instead of
            the average ones (Nakamoto & Tsuruno 3.7).
        lens: calibrated lens, used for frames with the aspect ratio of the calibration.
    """

    def __init__(
        self,
        mount: CameraMount,
        horizontal_field_deg: float,
        parts_face_m: Mapping[str, Vec3] | None = None,
        lens: LensParams | None = None,
    ) -> None:
        self._mount = mount
        own = parts_face_m or {}
        self._parts = tuple((own.get(code, PARTS_FACE_M[code]), code in own) for code in PARTS)
        self._locator = FrameLocator(lens, radians(horizontal_field_deg))
        self._tracker = Tracker()
        self._hands = Hands()
        self._tracks: tuple[BodyTrack, ...] = ()
        self._percept: Percept | None = None
        self._number = 0
        self._scene: tuple[int, Vec3] | None = None
        self._cuts = 0
        self.frames = 0
        self.frames_with_face = 0

    def see(self, detections: Detections | None, poses: PoseHistory) -> Percept | None:
        """Return the percept of the newest frame, None before the first."""
        if detections is None or detections.number == self._number:
            return self._percept
        self._number = detections.number
        self.frames += 1
        self.frames_with_face += bool(detections.faces)
        t_s = detections.captured_s
        R_head, p_head = poses.head_pose(t_s)
        R, p = self._mount.pose(R_head, p_head)
        axis = transpose(R)[2]
        if self._is_cut(detections.scene, axis):
            self._tracker.forget()
            self._tracks, self._hands = (), Hands()
            self._cuts += 1
        # Normally the camera's process has located them. A camera of another package may not do so,
        # and a frame in transit during a change of the lens was located with the former lens.
        located = detections.located
        if located is None or located.intrinsics != self._locator.intrinsics(detections):
            located = self._locator(detections)
        faces, things = (
            [one for one in places if not self._mount.is_ignored(sub(one.p_m, p))]
            for places in (
                [place_in_world(face, R, p) for face in located.faces],
                [place_in_world(thing, R, p) for thing in located.things],
            )
        )
        palms = located.palms and [place_in_world(one, R, p) for one in located.palms]
        people = [track for track in self._tracks if track.is_person]
        carried: list[tuple[int, Located]] = []
        if things or palms or self._hands.resting:
            tracked = [
                (add(t.p_world_m, scale(t.v_world_m_s, t_s - t.at_s)), t.v_world_m_s)
                for t in people
            ]
            known = known_faces(faces, tracked)
            things = self._hands.label(things, known, p, t_s, palms)
            faces, things, carried = without_own_motion(faces, things, known, p)
            # A patch that may be a walking person is at the position of the head, not at the feet.
            things = [
                thing._replace(p_m=thing.upper_m or thing.p_m) if thing.kind == UNNAMED else thing
                for thing in things
            ]
        in_sight = self._tracker.step([*faces, *things], p, t_s)
        for k, thing in carried:
            if people[k].seen_s < t_s:
                correct_velocity(people[k], thing)
        for track in in_sight:
            if track.seen_s == t_s:
                track.life.record(track.filter, axis, t_s)
        ways = [rotate_back(R, sub(track.p_world_m, p)) for track in in_sight]
        inside = _in_picture(ways, located.intrinsics, detections)
        self._tracks = tracks = tuple(
            [
                track
                for track, here in zip(in_sight, inside, strict=True)
                if track.counts and (here or (track.seen_s == t_s and _stays_beyond_edge(track)))
            ]
        )
        self._percept = Percept(
            t_s,
            _bodies(tracks),
            tuple(self._face(track, p_head) for track in tracks if track.shows_face),
            self._cuts,
        )
        return self._percept

    def _is_cut(self, scene: int, axis: Vec3) -> bool:
        """Return whether a frame shows another scene although the camera was hardly turned.

        A restarted camera process always counts as another scene.

        Args:
            scene: number of the scene, from the images.
            axis: optical axis of the camera, in the world.
        """
        before, self._scene = self._scene, (scene, axis)
        if before is None or before[0] == scene:
            return False
        restarted = scene // SCENES_OF_A_PROCESS != before[0] // SCENES_OF_A_PROCESS
        return restarted or dot(before[1], axis) > _COS_SAME_VIEW

    def _face(self, track: BodyTrack, p_head: Vec3) -> Face:
        """Return a tracked face with its eight parts, seen from the head's position."""
        R = track.R_world_face
        assert R is not None  # visible faces are tracked with their pose
        p = track.p_world_m
        unknown_size = 0.0 if track.face_size else SIZE_SPREAD * track.filter.range_m
        # The filter covers errors that change; the unknown size of this person's face is constant.
        found = track.detection
        signs, t_s = found.signs, track.at_s
        seen = track.seen_s == t_s
        if signs is not None and seen:
            track.speech = track.speech.advance(signs.mouth_opening_m, t_s, signs.mouth_sd_m)
            if signs.eye_opening is not None:
                track.eyes, track.eyes_s = found, t_s
        eyes = track.eyes if track.eyes and t_s - track.eyes_s <= EYES_HELD_S else found
        gaze, opening = eyes.gaze, eyes.signs and eyes.signs.eye_opening
        off_rad = angle_between(gaze or transpose(R)[0], sub(p_head, p))
        # A blink does not end a look at the head.
        blinks = opening is not None and opening < EYES_SHUT
        if seen and not blinks:
            track.looks_at_head = looks_at_head(
                off_rad, found.turn_sd_rad, gaze is not None, track.looks_at_head
            )
        # A measured part keeps its measured position; a canonical one is stretched with the face.
        size, length = track.face_size or 1.0, track.face_length
        parts = tuple(
            [
                add(
                    p, rotate(R, at if own else (size * at[0], size * at[1], size * length * at[2]))
                )
                for at, own in self._parts
            ]
        )
        return Face(
            track.id,
            p,
            track.v_world_m_s,
            R,
            parts,
            found.confidence,
            track.depth_from,
            hypot(sqrt(track.filter.along.p), unknown_size),
            off_rad,
            track.looks_at_head,
            gaze,
            opening,
            signs and signs.mouth_opening_m,
            track.is_alive and track.speech.speaks(t_s) if signs else None,
            track.life.has_moved,
        )


def _stays_beyond_edge(track: BodyTrack) -> bool:
    """Return whether a body with its middle beyond the picture counts: a patch must come fast."""
    comes_m_s = -dot(track.filter.v_m_s, track.filter.view)
    return track.detection.kind != UNNAMED or comes_m_s > _COMES_M_S


def _in_picture(p_camera_m: list[Vec3], lens: Intrinsics, found: Detections) -> list[bool]:
    """Return which positions are inside the image; people outside it are only remembered."""
    places = project(p_camera_m, lens).tolist() if p_camera_m else []  # NaN behind the camera
    return [0.0 <= x < found.width_px and 0.0 <= y < found.height_px for x, y in places]


def _bodies(tracks: tuple[BodyTrack, ...]) -> Bodies:
    """Return faces and moving things as bodies; a spin in the image is about the view line."""
    if not tracks:
        return Bodies()
    found, filters = [track.detection for track in tracks], [track.filter for track in tracks]
    return Bodies(
        tuple([track.id for track in tracks]),
        tuple([one.kind for one in found]),
        np.array([one.p_m for one in filters]),
        np.array([one.v_m_s for one in filters]),
        np.array([scale(track.filter.view, track.detection.spin_rad_s) for track in tracks]),
        np.array([one.radius_m for one in found]),
        np.array([covariance(one.view, one.across.v, one.along.v) for one in filters]),
        tuple([track.id for track in tracks if track.detection.from_side]),
        tuple([track.id for track in tracks if track.is_person and not track.is_alive]),
    )


def covariance(view: Vec3, across: float, along: float) -> list[list[float]]:
    """Return the covariance matrix in the world of variances across and along a view.

    Across the view a variance is the same in all directions.
    """
    more = along - across
    return [
        [(across if x == y else 0.0) + more * view[x] * view[y] for y in range(3)] for x in range(3)
    ]


NEAR_RAD = 0.12
"""A pixel within this angle (7 deg) of a person gets the person's distance."""
USUAL_M = 1.5
"""Assumed distance of an unknown thing: across a desk, plus one step."""

_PATCH = 0.03  # side of the square whose depth is read, as a fraction of the frame's width


class PixelToWorld:
    """Locates pixels by the lens, the camera's mount and the head's pose at the exposure.

    Args:
        mount: position and orientation of the camera on the head.
        poses: history of the head's pose.
        camera: returns the present lens.
    """

    def __init__(
        self, mount: CameraMount, poses: PoseHistory, camera: Callable[[], CameraParams]
    ) -> None:
        self._mount, self._poses, self._camera = mount, poses, camera

    def point(
        self,
        pixel: tuple[float, float],
        found: Detections,
        percept: Percept | None,
        distance_m: float | None = None,
        captured_s: float | None = None,
    ) -> Vec3:
        """Return the point of the world at a pixel, in metres.

        Args:
            pixel: (x, y) relative to the centre of the upper left pixel, x right, y down.
            found: the newest frame, whose size and lens are used.
            percept: its percept, for the distance of a pixel next to a person.
            distance_m: distance from the camera; None: the measured depth at the pixel, or that of
                a nearby person or thing.
            captured_s: exposure of the frame with the pixel; None: that of the newest frame.
        """
        at_s = found.captured_s if captured_s is None else captured_s
        R, p = self._mount.pose(*self._poses.head_pose(at_s))
        camera, size_px = self._camera(), (found.width_px, found.height_px)
        field_rad = radians(camera.horizontal_field_deg)
        lens = intrinsics_of_lens(camera.lens, field_rad, *size_px, found.lens)
        through = rotate(
            R, vec(rays([pixel], lens)[0])
        )  # 1 m deep: depth is along the optical axis
        depth_m = (
            _depth_m(found, pixel) if at_s == found.captured_s and distance_m is None else None
        )
        if depth_m is not None:
            return add(p, scale(through, depth_m))
        direction = unit(through)
        if distance_m is None:
            distance_m = seen_distance_m(percept, p, direction)
        return add(p, scale(direction, distance_m))


def seen_distance_m(percept: Percept | None, p_world_m: Vec3, direction_world: Vec3) -> float:
    """Return the distance of the person or thing at a pixel.

    Args:
        percept: percept of the frame.
        p_world_m: position of the camera.
        direction_world: unit vector through the pixel.
    """
    near, best = USUAL_M, NEAR_RAD
    if percept is None:
        return near
    places = [face.p_world_m for face in percept.faces]
    places += map(vec, percept.bodies.p_world_m)
    for place in places:
        there = sub(place, p_world_m)
        angle = angle_between(unit(there), direction_world)
        if angle < best:
            near, best = norm(there), angle
    return near


def _depth_m(found: Detections, pixel: tuple[float, float]) -> float | None:
    """Return the measured depth around a pixel of the camera frame, None without one."""
    if found.depth_m is None:
        return None
    height, width = found.depth_m.shape[:2]
    side = max(3.0, _PATCH * hypot(width, height))
    box = (pixel[0] - side / 2, pixel[1] - side / 2, side, side)
    return depth_at(found.depth_m, box, shrink=1.0).distance_m
