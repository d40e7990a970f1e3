"""Tracking: identities, positions and velocities of people and things, from frame to frame.

World frame, metres. Every detection has its own uncertainty, which may be much larger along the
line of view than across it. All pairs of track and detection are evaluated together by the distance
relative to these uncertainties (data_association), and a Kalman filter of direction and range
(kalman) updates each track with its detection.

People are numbered from 1, things separately. A person who is out of sight is first looked for at
the last position; one who appears elsewhere keeps the number if position, time, height, size of the
face and colours of the clothes together allow it. The cost of such a pair is minus twice the log of
the odds that both are one person, as in ``data_association``.
"""

from collections.abc import Sequence
from math import inf, log, log10, radians

from gazerig.drivers.types import Clothing, Located
from gazerig.gaze.angles import add, angle_between, cross, norm, scale, sub, transpose, unit
from gazerig.gaze.types import FIRST_THING, Mat3, Vec3
from gazerig.robot.perception.data_association import (
    FASTEST_M_S,
    UNPAIRED,
    assign,
    note_covered,
    pair_costs,
)
from gazerig.robot.perception.kalman import ProcessNoise, TrackFilter
from gazerig.robot.perception.track import (
    FACE,
    FORGET_S,
    IN_SIGHT_S,
    UNNAMED,
    BodyTrack,
    Life,
    SeenPerson,
    clothing_costs,
)

# Cost of a return after a time, its increase for each factor of ten in time, and the least time.
_SOON, _PER_DECADE, _FIRST_S, _LEAST_S = -2.75, 1.25, 10.0, 0.1
# Extra cost without clothes: a stranger of the same height matches too easily.
_UNDRESSED = 0.75
# Standard deviations of a person's height from visit to visit, and of the logarithm of the size of
# a face; largest cost of either, as people sit down and faces are measured inaccurately.
_HEIGHT_SD_M, _SIZE_SD, _MOST = 0.12, 0.06, 6.0
# Standard deviations of a person's position at once, and in addition per second of absence; and
# the largest distance, in them.
_AT_ONCE_SD_M, _WALKS_SD_M_S, _FARTHEST = 0.25, 1.0, 2.0


def _return_cost(gone: SeenPerson, new: SeenPerson) -> float:
    """Return the cost of the match of a new person and one who left; infinite if impossible."""
    gone_s = new.seen_s - gone.seen_s
    moved = norm(sub(gone.p_world_m, new.p_world_m)) / (_AT_ONCE_SD_M + _WALKS_SD_M_S * gone_s)
    if moved > _FARTHEST:
        return inf
    cost = moved * moved + _SOON + _PER_DECADE * log10(max(gone_s, _LEAST_S) / _FIRST_S)
    cost += min(((new.p_world_m[2] - gone.p_world_m[2]) / _HEIGHT_SD_M) ** 2, _MOST)
    if gone.face_size is not None and new.face_size is not None:
        cost += min((log(new.face_size / gone.face_size) / _SIZE_SD) ** 2, _MOST)
    if gone.colours is None or new.colours is None:
        return cost + _UNDRESSED
    worn = clothing_costs([gone.colours], [Clothing(tuple(new.colours.tolist()), 1.0)])
    return cost + (worn[0][0] if worn else 0.0)


def find_returned(left: Sequence[SeenPerson], new: SeenPerson) -> SeenPerson | None:
    """Return the person who left and has returned as a new person, None if there is none."""
    costs = [_return_cost(one, new) for one in left]
    return left[costs.index(min(costs))] if min(costs, default=inf) < 0.0 else None


_OF_FACES = ProcessNoise(0.12, 10.0)
"""The usual acceleration of faces: smaller values give smoother tracks, larger ones follow changes
sooner; and that while the images show that a person starts or stops moving."""
_OF_THINGS = ProcessNoise(1.0, 10.0)
_FIRST_SPEED_M_S = 0.7
"""Standard deviation of the speed of a new track."""
_TURN_GAIN, _GAIN = 0.3, 0.15
"""Weights of a new frame in the smoothed orientation, and length, size and flatness, of a face."""
_COAST_PERSON_S = 1.2
"""A person whose face is not visible is reported for longer, as people are searched rarely."""
_REMEMBER_FACE_S = 20.0
"""A face that is not visible for longer is remembered for this time: it is recognised within
``GATE_M``, and is a target if no face is visible."""
_REMEMBER_PERSON_S = 300.0
"""A person who returns within this time keeps the number, if position, height and clothes match."""
# At a cut of a film on a screen a face is suddenly elsewhere: farther from its expected position
# than a distance, and than a speed allows, in about two frames. From the second cut within this
# angle and time on, faces that appear or jump there are in a film. Jumps within a shorter time are
# of one cut, or of one fast turn of the camera, in which a face at the edge is measured badly.
_JUMP_M, _JUMP_M_S = 0.1, 2.0
_FILM_RAD, _FILM_S, _JUMPS, _CUT_S = radians(12.0), 30.0, 4, 0.5
# Time after which a person who is out of sight may be one in view whose clothes are known.
_LOST_S = 0.8
# A person in fewer frames than this may be a false detection, which is not remembered. Number of
# frames with clothes after which the number is final. Largest number of stored people who left.
_KNOWN, _CLOTHED, _MOST_LEFT = 10, 5, 30


class Tracker:
    """Tracker of faces and moving things: identities and velocities."""

    def __init__(self) -> None:
        self._tracks: list[BodyTrack] = []
        self._next_person, self._next_thing = 1, FIRST_THING
        self._left: list[SeenPerson] = []
        self._jumps: list[tuple[Vec3, float]] = []

    def forget(self) -> None:
        """End all identities, after a change of the scene. Numbers are not reused."""
        self._tracks, self._left = [], []

    def step(
        self, detections: list[Located], p_world_camera_m: Vec3, t_s: float
    ) -> tuple[BodyTrack, ...]:
        """Associate the detections of one frame with the tracks; return the tracks in sight."""
        for track in self._tracks:
            if not track.is_remembered:
                track.filter.predict(
                    t_s - track.at_s,
                    track.seen_s == track.at_s,
                    track.depth_from != "assumed",
                    track.is_person,
                )
            track.filter.look_from(p_world_camera_m)
            track.at_s = t_s
        worn = clothing_costs(
            [track.clothes.colours for track in self._tracks],
            [found.clothing for found in detections],
        )
        note_covered(self._tracks)
        costs = pair_costs(self._tracks, detections, p_world_camera_m, worn)
        pairs = assign(costs, UNPAIRED)
        for i, j in pairs:
            self._update_track(self._tracks[i], detections[j], p_world_camera_m)
        taken = {j for _, j in pairs}
        renamed = {
            found.detector_id
            for found in detections
            if found.detector_id is not None and found.kind != UNNAMED
        }
        # A thing that is later recognised as a hand is not new: it keeps its number.
        ids = {t.detection.detector_id: t.id for t in self._tracks if _is_another_now(t, renamed)}
        for j, detection in enumerate(detections):
            if j not in taken:
                track = self._begin_track(detection, p_world_camera_m, t_s)
                if detection.kind not in (UNNAMED, FACE):
                    track.id = ids.pop(detection.detector_id, track.id)
                self._tracks.append(track)
        for track in self._tracks:
            if track.is_person and not track.is_number_final and track.clothes.frames >= _CLOTHED:
                self._number(track)
                track.is_number_final = True
        kept = [
            t
            for t in self._tracks
            if t.unseen_s <= (_REMEMBER_FACE_S if t.is_person and t.frames >= _KNOWN else FORGET_S)
            and not _is_another_now(t, renamed)
        ]
        for track in self._tracks:
            if not track.is_person or track in kept:
                continue
            if track.frames >= _KNOWN:
                self._left = [*self._left, _person(track)][-_MOST_LEFT:]
            elif track.returned_person is not None:
                self._left.append(track.returned_person)
        self._tracks = kept
        return tuple([t for t in self._tracks if t.unseen_s <= self._coasts_s(t)])

    def _coasts_s(self, track: BodyTrack) -> float:
        """Return the time for which a track without a detection is still reported."""
        by_body = track.is_person and track.seen_s > track.faced_s and track.frames > 1
        return _COAST_PERSON_S if by_body else IN_SIGHT_S

    def _begin_track(self, detection: Located, p_camera: Vec3, t_s: float) -> BodyTrack:
        track = BodyTrack(
            0,
            detection,
            TrackFilter(
                detection.p_m,
                p_camera,
                (detection.across_sd_m, detection.along_sd_m),
                _FIRST_SPEED_M_S,
                _OF_FACES if detection.kind == FACE else _OF_THINGS,
            ),
            detection.R_face,
            t_s,
            t_s,
            detection.face_length,
            Life(inf if detection.R_face is None else 0.0),
            faced_s=t_s if detection.R_face is not None else -inf,
        )
        self._learn_size(track, detection, 1.0)
        track.clothes.learn(detection.clothing)
        correct_velocity(track, detection)
        if track.is_person:
            self._number(track)
            self._note_film(track)
        else:
            track.id, self._next_thing = self._next_thing, self._next_thing + 1
        return track

    def _note_film(self, track: BodyTrack) -> None:
        """Record that a face appeared or jumped where faces often jump: it is in a film."""
        near = [
            at_s
            for view, at_s in self._jumps
            if track.at_s - at_s < _FILM_S and angle_between(view, track.filter.view) < _FILM_RAD
        ]
        if len(near) >= _JUMPS and near[-1] - near[0] > _CUT_S:
            track.filmed_s = track.at_s

    def _number(self, track: BodyTrack) -> None:
        """Give a person's new track the number of the person who has returned, or the next one."""
        if track.returned_person is not None:
            self._left.append(track.returned_person)
        # Without clothes, one who was missed for a moment is not another who appears nearby.
        lost_s = _LOST_S if track.clothes.frames >= _CLOTHED else FORGET_S
        gone = [
            one
            for one in self._tracks
            if one.is_person and one is not track and one.unseen_s > lost_s
        ]
        before, known = track.returned_person, [*self._left, *map(_person, gone)]
        recent = [one for one in known if track.at_s - one.seen_s <= _REMEMBER_PERSON_S]
        track.returned_person = back = find_returned(recent, _person(track))
        if back is None:
            if before is not None or not track.id:
                track.id, self._next_person = self._next_person, self._next_person + 1
            return
        track.id = back.id
        self._left = [one for one in self._left if one.id != back.id]
        self._tracks = [one for one in self._tracks if one not in gone or one.id != back.id]

    def _update_track(self, track: BodyTrack, detection: Located, p_camera: Vec3) -> None:
        place, R = detection.p_m, detection.R_face
        if track.face_size and R is not None and not detection.depth_measured:
            place = add(p_camera, scale(sub(place, p_camera), track.face_size))
        known = track.filter
        jump_m = known.range_m * angle_between(sub(place, p_camera), known.view)
        if R and track.R_world_face and jump_m > max(_JUMP_M, _JUMP_M_S * track.unseen_s):
            self._jumps = [*self._jumps[-_MOST_LEFT:], (known.view, track.at_s)]
            self._note_film(track)
        elif track.unseen_s > IN_SIGHT_S:
            self._note_film(track)
        known.correct(place, detection.across_sd_m, detection.along_sd_m)
        correct_velocity(track, detection)
        if track.is_person:
            known.slow_to(FASTEST_M_S)
        track.seen_s = track.at_s
        track.frames += 1
        track.clothes.learn(detection.clothing)
        if R is None and track.shows_face:
            return  # the detector missed the face in this frame
        if R is None:
            track.R_world_face = track.looks_at_head = None
        else:
            before, track.faced_s = track.R_world_face, track.at_s
            track.flat += _GAIN * (detection.flat - track.flat)
            if before is None:
                track.R_world_face, track.face_length = R, detection.face_length
            else:
                track.R_world_face = _blend(before, R, _TURN_GAIN)
                track.face_length += _GAIN * (detection.face_length - track.face_length)
        self._learn_size(track, detection, _GAIN)
        track.detection = detection

    def _learn_size(self, track: BodyTrack, detection: Located, gain: float) -> None:
        """Learn the size of a face whose distance is measured."""
        if detection.size_depth is None:
            return
        size, before = 1.0 / detection.size_depth, track.face_size
        track.face_size = size if before is None else before + gain * (size - before)


def _person(track: BodyTrack) -> SeenPerson:
    size, worn = track.face_size, track.clothes.colours
    if (before := track.returned_person) is not None:
        size = before.face_size if size is None else size
        worn = before.colours if worn is None else worn
    return SeenPerson(track.id, track.p_world_m, track.seen_s, size, worn)


def _is_another_now(track: BodyTrack, renamed: set[int]) -> bool:
    """Return whether the detector's number of a thing now belongs to another known thing."""
    return track.detection.kind == UNNAMED and track.detection.detector_id in renamed


def correct_velocity(track: BodyTrack, found: Located) -> None:
    """Update a track with a velocity that was measured in the image."""
    if found.v_m_s is not None:
        sds = found.across_sd_m_s, found.along_sd_m_s
        track.filter.correct_velocity(found.p_m, found.v_m_s, *sds)


def _blend(A: Mat3, B: Mat3, share: float) -> Mat3:
    """Return the rotation at a fraction of the path from A to B (columns blended, orthonormal)."""
    x, _, z = (
        add(a, scale(sub(b, a), share)) for a, b in zip(transpose(A), transpose(B), strict=True)
    )
    x = unit(x)
    y = unit(cross(z, x))
    return transpose((x, y, cross(x, y)))
