"""What tracking assumes of the motion of people and things."""

from dataclasses import dataclass
from typing import Annotated

from gazerig.params import Bounds


@dataclass(frozen=True)
class TrackParams:
    """What is believed of how people and things move, and times of the tracking."""

    # fmt: off
    quiet_accel_m_s2: Annotated[float, Bounds(0.01, 50), "usual acceleration of faces; smaller is smoother, larger follows sooner"] = 0.12
    lively_accel_m_s2: Annotated[float, Bounds(0.01, 500),
        "the same at the moment somebody starts or stops, as told by the pictures"] = 10.0
    things_accel_m_s2: Annotated[float, Bounds(0.01, 50), "usual acceleration of hands and things"] = 1.0
    first_speed_m_s: Annotated[float, Bounds(0, 20), "usual speed of something when it is first seen"] = 0.7
    gate_sigma: Annotated[float, Bounds(1, 20),
        "farthest from its expected place that something is taken for the same, in standard deviations of all that is uncertain"] = 4.0
    gate_m: Annotated[float, Bounds(0.02, 5),
        "the same in metres across the line of view, at up to 1 m; beyond, it grows with the distance as the errors do"] = 0.35
    gate_speed_m_s: Annotated[float, Bounds(0, 20), "that gate widens so fast while somebody is not seen"] = 1.0
    turn_gain: Annotated[float, Bounds(0.01, 1), "trust in a picture for the turn of a face"] = 0.3
    shape_gain: Annotated[float, Bounds(0.01, 1), "trust in a picture for the length and the size of a face"] = 0.15
    coast_ms: Annotated[float, Bounds(0, 5000), "something missed by the detector is still there for this long"] = 250.0
    forget_ms: Annotated[float, Bounds(0, 60000), "something unseen for this long is somebody new when it returns"] = 1500.0
    # fmt: on
