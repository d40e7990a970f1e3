"""Parameters of the tracking of people and things."""

from dataclasses import dataclass
from typing import Annotated

from gazerig.params import Bounds


@dataclass(frozen=True)
class TrackerParams:
    """Assumed motion of people and things, and times of the tracking."""

    # fmt: off
    quiet_accel_m_s2: Annotated[float, Bounds(0.01, 50),
        "process noise of faces: their usual acceleration; smaller values give smoother tracks, larger ones follow changes sooner"] = 0.12
    lively_accel_m_s2: Annotated[float, Bounds(0.01, 500),
        "process noise while the images show that a person starts or stops moving"] = 10.0
    things_accel_m_s2: Annotated[float, Bounds(0.01, 50), "process noise of hands and things: their usual acceleration"] = 1.0
    first_speed_m_s: Annotated[float, Bounds(0, 20), "standard deviation of the speed of a new track"] = 0.7
    gate_sigma: Annotated[float, Bounds(1, 20),
        "gate of data association: largest distance between predicted and detected position, in standard deviations of their "
        "difference"] = 4.0
    gate_m: Annotated[float, Bounds(0.02, 5),
        "gate of data association in metres across the line of sight, for distances up to 1 m; beyond, it grows in proportion to "
        "the distance"] = 0.35
    gate_speed_m_s: Annotated[float, Bounds(0, 20), "speed at which gate_m widens while a track gets no detection"] = 1.0
    turn_gain: Annotated[float, Bounds(0.01, 1), "weight of a new frame in the smoothed orientation of a face"] = 0.3
    shape_gain: Annotated[float, Bounds(0.01, 1), "weight of a new frame in the smoothed length and size of a face"] = 0.15
    face_at_head_deg: Annotated[float, Bounds(1, 60),
        "a person whose face is turned to the head within this angle looks at it, if the detector finds no gaze of the eyes"] = 10.0
    eyes_at_head_deg: Annotated[float, Bounds(1, 60), "the same angle for the gaze of the eyes, if the detector finds it"] = 6.0
    coast_ms: Annotated[float, Bounds(0, 5000), "a track without a detection is still reported for this long"] = 250.0
    coast_person_ms: Annotated[float, Bounds(0, 10000),
        "a person whose face is not visible is still reported for this long: detector.people_hz searches rarely"] = 1200.0
    forget_ms: Annotated[float, Bounds(0, 60000),
        "a track without a detection is deleted after this long; a thing that returns later gets a new id"] = 1500.0
    remember_face_s: Annotated[float, Bounds(0, 3600),
        "a face that is not visible for longer is remembered for this time: it is recognised within gate_m, and is a target if no "
        "face is visible"] = 20.0
    remember_person_s: Annotated[float, Bounds(0, 3600),
        "a person who returns within this time keeps the number, if position, height and clothes match"] = 300.0
    # fmt: on
