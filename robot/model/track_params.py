"""What tracking assumes of the motion of people and things."""

from dataclasses import dataclass, field


@dataclass(frozen=True)
class TrackParams:
    """What is believed of how people and things move, and times of the tracking."""

    quiet_accel_m_s2: float = field(
        default=0.12,
        metadata={
            "low": 0.01,
            "high": 50.0,
            "unit": "m/s2",
            "says": "usual acceleration of faces; smaller is smoother, larger follows sooner",
        },
    )
    lively_accel_m_s2: float = field(
        default=10.0,
        metadata={
            "low": 0.01,
            "high": 500.0,
            "unit": "m/s2",
            "says": "the same at the moment somebody starts or stops, as told by the pictures",
        },
    )
    things_accel_m_s2: float = field(
        default=1.0,
        metadata={
            "low": 0.01,
            "high": 50.0,
            "unit": "m/s2",
            "says": "usual acceleration of hands and things",
        },
    )
    first_speed_m_s: float = field(
        default=0.7,
        metadata={
            "low": 0.0,
            "high": 20.0,
            "unit": "m/s",
            "says": "usual speed of something when it is first seen",
        },
    )
    gate_sigma: float = field(
        default=4.0,
        metadata={
            "low": 1.0,
            "high": 20.0,
            "unit": "",
            "says": "farthest from its expected place that something is taken for the same, in "
            "standard deviations of all that is uncertain",
        },
    )
    gate_m: float = field(
        default=0.35,
        metadata={
            "low": 0.02,
            "high": 5.0,
            "unit": "m",
            "says": "the same in metres across the line of view, at up to 1 m; beyond, it grows "
            "with the distance as the errors do",
        },
    )
    gate_speed_m_s: float = field(
        default=1.0,
        metadata={
            "low": 0.0,
            "high": 20.0,
            "unit": "m/s",
            "says": "that gate widens so fast while somebody is not seen",
        },
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
    shape_gain: float = field(
        default=0.15,
        metadata={
            "low": 0.01,
            "high": 1.0,
            "unit": "",
            "says": "trust in a picture for the length and the size of a face",
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
