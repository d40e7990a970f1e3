"""What the guard goes by beside the joints' own limits."""

from dataclasses import dataclass, field

from gazerig.robot.model.forbidden_range import CollisionParams


@dataclass(frozen=True)
class HealthParams:
    """From where servos are slowed down and stopped, before they switch themselves off."""

    warm_c: float = field(
        default=15.0,
        metadata={
            "low": 1.0,
            "high": 60.0,
            "unit": "degC",
            "says": "slower from so far below the temperature at which the servo gives up",
        },
    )
    hot_c: float = field(
        default=5.0,
        metadata={
            "low": 0.0,
            "high": 40.0,
            "unit": "degC",
            "says": "standing still from so far below it",
        },
    )
    slowest: float = field(
        default=0.2,
        metadata={
            "low": 0.01,
            "high": 1.0,
            "unit": "",
            "says": "share of speed and acceleration that is left just before standing still",
        },
    )
    lasting_load: float = field(
        default=0.5,
        metadata={
            "low": 0.05,
            "high": 0.95,
            "unit": "",
            "says": "share of the stall torque that may last; more is counted by its square "
            "(I2t), as the motor's heat goes",
        },
    )
    overload_ms: float = field(
        default=700.0,
        metadata={
            "low": 50.0,
            "high": 60000.0,
            "unit": "ms",
            "says": "full load for so long stops a joint; slower from half of that",
        },
    )
    voltage_margin_v: float = field(
        default=0.3,
        metadata={
            "low": 0.0,
            "high": 5.0,
            "unit": "V",
            "says": "slower when the voltage is so near the servo's own limits",
        },
    )
    voltage_ms: float = field(
        default=500.0,
        metadata={
            "low": 0.0,
            "high": 60000.0,
            "unit": "ms",
            "says": "standing still when it is outside for longer",
        },
    )

    def __post_init__(self) -> None:
        """Check that there is a way from warm to hot.

        Raises:
            ValueError: there is none.
        """
        if self.hot_c >= self.warm_c:
            raise ValueError(f"hot_c {self.hot_c} must be below warm_c {self.warm_c}")


@dataclass(frozen=True)
class StuckParams:
    """When a joint counts as stuck, and how it tries again."""

    stuck_deg: float = field(
        default=3.0,
        metadata={
            "low": 0.5,
            "high": 45.0,
            "unit": "deg",
            "says": "a joint this far from its command ought to be moving; more than friction "
            "and weight leave",
        },
    )
    moved_deg: float = field(
        default=0.5,
        metadata={
            "low": 0.1,
            "high": 10.0,
            "unit": "deg",
            "says": "a way towards the command that counts as moving",
        },
    )
    # Dead time of a healthy servo is some 30 ms; with an answer's age and one tick more the
    # joint is found within 200 ms.
    stuck_ms: float = field(
        default=150.0,
        metadata={
            "low": 50.0,
            "high": 5000.0,
            "unit": "ms",
            "says": "a joint that has not moved for so long is stuck: it stops pushing",
        },
    )
    retry_ms: float = field(
        default=1000.0,
        metadata={
            "low": 100.0,
            "high": 60000.0,
            "unit": "ms",
            "says": "a stuck joint tries again, slowly, after so long",
        },
    )
    retry_deg: float = field(
        default=4.5,
        metadata={
            "low": 0.5,
            "high": 45.0,
            "unit": "deg",
            "says": "then the command is never farther ahead of the joint, so it pushes weakly",
        },
    )

    def __post_init__(self) -> None:
        """Check that a joint that tries again can be found stuck again.

        Raises:
            ValueError: it could not; the message says what would do.
        """
        if self.retry_deg <= self.stuck_deg:
            raise ValueError(f"retry_deg {self.retry_deg} must be above stuck_deg {self.stuck_deg}")
        if self.moved_deg >= self.stuck_deg:
            raise ValueError(f"moved_deg {self.moved_deg} must be below stuck_deg {self.stuck_deg}")


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
