"""Who is who from picture to picture: nearest-place association and steady-gain filters.

World frame, metres. The distance of a face comes from its size and is known far worse
than its direction, so each innovation is split along and across the line of view, with
gains of their own; what was measured by depth needs no such care.
"""

from dataclasses import dataclass, field

from gaze.angles import add, cross, dot, norm, scale, sub, unit
from gaze.types import Mat3, Vec3

_STILL: Vec3 = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class TrackParams:
    """Gains and times of the tracking."""

    gate_m: float = field(
        default=0.35,
        metadata={
            "low": 0.02,
            "high": 5.0,
            "unit": "m",
            "says": "farthest from its expected place that something is taken for the same, at "
            "up to 1 m; beyond, it grows with the distance as the errors do",
        },
    )
    across_gain: float = field(
        default=0.5,
        metadata={
            "low": 0.01,
            "high": 1.0,
            "unit": "",
            "says": "trust in a picture, across the line of view",
        },
    )
    across_velocity_gain: float = field(
        default=0.15,
        metadata={
            "low": 0.0,
            "high": 1.0,
            "unit": "",
            "says": "the same for the velocity",
        },
    )
    along_gain: float = field(
        default=0.15,
        metadata={
            "low": 0.01,
            "high": 1.0,
            "unit": "",
            "says": "trust in a picture, along the line of view",
        },
    )
    along_velocity_gain: float = field(
        default=0.01,
        metadata={"low": 0.0, "high": 1.0, "unit": "", "says": "the same for the velocity"},
    )
    turn_gain: float = field(
        default=0.3,
        metadata={
            "low": 0.01,
            "high": 1.0,
            "unit": "",
            "says": "trust in a picture for the turn of a face",
        },
    )
    coast_ms: float = field(
        default=250.0,
        metadata={
            "low": 0.0,
            "high": 5000.0,
            "unit": "ms",
            "says": "something missed by the detector is still there for this long",
        },
    )
    forget_ms: float = field(
        default=1500.0,
        metadata={
            "low": 0.0,
            "high": 60000.0,
            "unit": "ms",
            "says": "something unseen for this long is somebody new when it returns",
        },
    )


@dataclass(slots=True)
class Sighting:
    """One thing as one picture shows it, placed in the world.

    R_world_face: axes of a face, None of anything else
    face_length: of a face, in lengths of the canonical one
    depth_measured: whether the distance is as good as the direction
    """

    kind: str
    p_world_m: Vec3
    R_world_face: Mat3 | None
    radius_m: float
    spin_rad_s: float
    confidence: float
    face_length: float = 1.0
    depth_measured: bool = False


@dataclass(slots=True)
class Track:
    """One thing through time."""

    id: int
    sighting: Sighting
    p_world_m: Vec3
    v_world_m_s: Vec3
    R_world_face: Mat3 | None
    seen_s: float
    at_s: float
    face_length: float

    def expected(self, t_s: float) -> Vec3:
        """Give where it should be."""
        return add(self.p_world_m, scale(self.v_world_m_s, t_s - self.at_s))


class Tracker:
    """Keeps identities and velocities of faces and moving things."""

    def __init__(self, params: TrackParams) -> None:
        """Take the gains."""
        self._params = params
        self._tracks: list[Track] = []
        self._next_id = 1

    def step(
        self, sightings: list[Sighting], p_world_camera_m: Vec3, t_s: float
    ) -> tuple[Track, ...]:
        """Join one picture's sightings to the tracks; give those that are there now."""
        par = self._params
        pairs = sorted(
            (norm(sub(track.expected(t_s), sighting.p_world_m)), i, j)
            for i, track in enumerate(self._tracks)
            for j, sighting in enumerate(sightings)
            if track.sighting.kind == sighting.kind
        )
        taken_tracks: set[int] = set()
        taken: set[int] = set()
        for distance, i, j in pairs:
            far = norm(sub(sightings[j].p_world_m, p_world_camera_m))
            if distance > par.gate_m * max(1.0, far):
                continue
            if i not in taken_tracks and j not in taken:
                taken_tracks.add(i)
                taken.add(j)
                self._update(self._tracks[i], sightings[j], p_world_camera_m, t_s)
        for j, sighting in enumerate(sightings):
            if j not in taken:
                self._tracks.append(self._begin(sighting, t_s))
        self._tracks = [
            track for track in self._tracks if t_s - track.seen_s <= par.forget_ms / 1e3
        ]
        for track in self._tracks:
            if track.at_s < t_s:  # missed: it coasts, and slows down while it does
                track.p_world_m = track.expected(t_s)
                track.v_world_m_s = scale(track.v_world_m_s, 0.8)
                track.at_s = t_s
        return tuple(track for track in self._tracks if t_s - track.seen_s <= par.coast_ms / 1e3)

    def _begin(self, sighting: Sighting, t_s: float) -> Track:
        track = Track(
            self._next_id,
            sighting,
            sighting.p_world_m,
            _STILL,
            sighting.R_world_face,
            t_s,
            t_s,
            sighting.face_length,
        )
        self._next_id += 1
        return track

    def _update(self, track: Track, sighting: Sighting, p_camera: Vec3, t_s: float) -> None:
        """Correct the expected place by the innovation, split along and across the view."""
        par = self._params
        dt_s = t_s - track.at_s
        expected = track.expected(t_s)
        innovation = sub(sighting.p_world_m, expected)
        view = unit(sub(expected, p_camera))
        along = scale(view, dot(innovation, view))
        across = sub(innovation, along)
        measured = sighting.depth_measured
        along_gain = par.across_gain if measured else par.along_gain
        along_velocity_gain = par.across_velocity_gain if measured else par.along_velocity_gain
        track.p_world_m = add(
            expected, add(scale(along, along_gain), scale(across, par.across_gain))
        )
        if dt_s > 0.0:
            change = add(
                scale(along, along_velocity_gain / dt_s),
                scale(across, par.across_velocity_gain / dt_s),
            )
            track.v_world_m_s = add(track.v_world_m_s, change)
        if track.R_world_face is not None and sighting.R_world_face is not None:
            track.R_world_face = blended(track.R_world_face, sighting.R_world_face, par.turn_gain)
            track.face_length += par.along_gain * (sighting.face_length - track.face_length)
        track.sighting, track.seen_s, track.at_s = sighting, t_s, t_s


def blended(A: Mat3, B: Mat3, share: float) -> Mat3:
    """Give a rotation a share of the way from A to B (columns blended, made square again)."""
    x = unit(_column(A, B, 0, share))
    z = _column(A, B, 2, share)
    y = unit(cross(z, x))
    z = cross(x, y)
    return ((x[0], y[0], z[0]), (x[1], y[1], z[1]), (x[2], y[2], z[2]))


def _column(A: Mat3, B: Mat3, k: int, share: float) -> Vec3:
    return (
        A[0][k] + share * (B[0][k] - A[0][k]),
        A[1][k] + share * (B[1][k] - A[1][k]),
        A[2][k] + share * (B[2][k] - A[2][k]),
    )
