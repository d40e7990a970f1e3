"""Parameters of the guard besides the joints' own limits."""

from dataclasses import dataclass, field
from typing import Annotated

from gazerig.params import Bounds
from gazerig.robot.model.forbidden_range import CollisionParams


@dataclass(frozen=True)
class HealthParams:
    """Thresholds for slowing and stopping servos before they switch themselves off."""

    # fmt: off
    warm_c: Annotated[float, Bounds(1, 60), "a joint is slowed down from this far below the servo's own temperature limit"] = 15.0
    hot_c: Annotated[float, Bounds(0, 40), "a joint is stopped from this far below that limit"] = 5.0
    slowest: Annotated[float, Bounds(0.01, 1), "share of speed and acceleration that remains just before a joint is stopped"] = 0.2
    lasting_load: Annotated[float, Bounds(0.05, 0.95),
        "share of the stall torque that is allowed continuously; a higher load counts by its square (I2t), as it heats the motor"] = 0.5
    overload_ms: Annotated[float, Bounds(50, 60000),
        "full load for this long stops a joint; it is slowed down from half of this time"] = 700.0
    voltage_margin_v: Annotated[float, Bounds(0, 5),
        "a joint is slowed down when the voltage is this close to the servo's own limits"] = 0.3
    voltage_ms: Annotated[float, Bounds(0, 60000),
        "a joint is stopped when the voltage is outside those limits for longer than this"] = 500.0
    # fmt: on

    def __post_init__(self) -> None:
        """Check that the warm temperature is below the hot one.

        Raises:
            ValueError: It is not.
        """
        if self.hot_c >= self.warm_c:
            raise ValueError(f"hot_c {self.hot_c} must be below warm_c {self.warm_c}")


@dataclass(frozen=True)
class StallParams:
    """Detection of stalled joints, and their next try."""

    # fmt: off
    position_error_deg: Annotated[float, Bounds(0.5, 45),
        "a joint at least this far from its commanded angle should be moving; larger than the error that friction and weight leave"] = 3.0
    moved_deg: Annotated[float, Bounds(0.1, 10), "motion towards the commanded angle that counts as moving"] = 0.5
    # The dead time of a healthy servo is about 30 ms. With the age of an answer and one more tick
    # a stall is found within 200 ms.
    detection_ms: Annotated[float, Bounds(50, 5000), "a joint that has not moved for this long is stalled and stops pushing"] = 150.0
    retry_ms: Annotated[float, Bounds(100, 60000), "a stalled joint tries again, slowly, after this time"] = 1000.0
    retry_deg: Annotated[float, Bounds(0.5, 45),
        "while it tries again, the commanded angle is at most this far ahead of the joint, so that it pushes weakly"] = 4.5
    # fmt: on

    def __post_init__(self) -> None:
        """Check that a joint that tries again can be found stalled again.

        Raises:
            ValueError: It could not; the message states the required order.
        """
        if self.retry_deg <= self.position_error_deg:
            raise ValueError(
                f"retry_deg {self.retry_deg} must be above position_error_deg {self.position_error_deg}"
            )
        if self.moved_deg >= self.position_error_deg:
            raise ValueError(
                f"moved_deg {self.moved_deg} must be below position_error_deg {self.position_error_deg}"
            )


@dataclass(frozen=True)
class GuardParams:
    """Timeouts, slow motion, and limits of the servos' strain."""

    # fmt: off
    joint_timeout_ms: Annotated[float, Bounds(5, 5000), "a joint whose last measurement is older than this holds still"] = 150.0
    frame_timeout_ms: Annotated[float, Bounds(50, 60000), "the neck holds still while the last frame is older than this"] = 1500.0
    soft_start_ms: Annotated[float, Bounds(0, 60000), "shortest time of slow motion after torque-on"] = 1000.0
    soft_start_speed_deg_s: Annotated[float, Bounds(1, 500), "speed after torque-on and while parking"] = 60.0
    soft_start_accel_deg_s2: Annotated[float, Bounds(1, 50000), "acceleration after torque-on and while parking"] = 300.0
    late_ms: Annotated[float, Bounds(0, 5000),
        "acceleration is limited to late_accel_deg_s2 for this long after a tick that missed its slot"] = 50.0
    late_accel_deg_s2: Annotated[float, Bounds(10, 200_000),
        "acceleration limit after a late tick, as servos have braked when no goals came; slow motion regains its speed with it"] = 15000.0
    health: Annotated[HealthParams, "what the servos bear"] = field(default_factory=HealthParams)
    stall: Annotated[StallParams, "joints that are told to move and do not"] = field(default_factory=StallParams)
    collision_margin_deg: Annotated[float, Bounds(0.1, 20),
        "distance kept from forbidden ranges, as servos round positions and lag behind"] = 1.0
    collisions: Annotated[tuple[CollisionParams, ...], "pairs of joint ranges that must not be occupied at the same time"] = ()
    # fmt: on
