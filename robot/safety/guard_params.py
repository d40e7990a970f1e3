"""What the guard goes by beside the joints' own limits."""

from dataclasses import dataclass, field

from gazerig.robot.safety.collisions import CollisionParams
from gazerig.robot.safety.health import HealthParams
from gazerig.robot.safety.stall_detector import StuckParams


@dataclass(frozen=True)
class GuardParams:
    """Ages beyond which nothing moves, slow passages, and what the servos bear."""

    stale_joints_ms: float = field(
        default=150.0,
        metadata={
            "low": 5.0,
            "high": 5000.0,
            "unit": "ms",
            "says": "a joint whose last answer is older holds still",
        },
    )
    stale_picture_ms: float = field(
        default=1500.0,
        metadata={
            "low": 50.0,
            "high": 60000.0,
            "unit": "ms",
            "says": "the neck holds still when the last picture is older",
        },
    )
    gentle_ms: float = field(
        default=1000.0,
        metadata={
            "low": 0.0,
            "high": 60000.0,
            "unit": "ms",
            "says": "shortest time of slow motion after torque-on",
        },
    )
    gentle_speed_deg_s: float = field(
        default=60.0,
        metadata={
            "low": 1.0,
            "high": 500.0,
            "unit": "deg/s",
            "says": "speed after torque-on and while parking",
        },
    )
    gentle_accel_deg_s2: float = field(
        default=300.0,
        metadata={
            "low": 1.0,
            "high": 50000.0,
            "unit": "deg/s2",
            "says": "acceleration after torque-on and while parking",
        },
    )
    late_ms: float = field(
        default=50.0,
        metadata={
            "low": 0.0,
            "high": 5000.0,
            "unit": "ms",
            "says": "joints gather speed softly for so long after a tick that missed its slot",
        },
    )
    late_accel_deg_s2: float = field(
        default=15000.0,
        metadata={
            "low": 10.0,
            "high": 200000.0,
            "unit": "deg/s2",
            "says": "most acceleration while they do; servos brake when no goals come",
        },
    )
    health: HealthParams = field(
        default_factory=HealthParams, metadata={"says": "what the servos bear"}
    )
    stuck: StuckParams = field(
        default_factory=StuckParams, metadata={"says": "joints that are told to move and do not"}
    )
    collision_margin_deg: float = field(
        default=1.0,
        metadata={
            "low": 0.1,
            "high": 20.0,
            "unit": "deg",
            "says": "distance kept from collisions; servos round and lag",
        },
    )
    collisions: tuple[CollisionParams, ...] = field(
        default=(),
        metadata={"says": "pairs of joint ranges that may not be taken together"},
    )
