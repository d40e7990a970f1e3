"""The rate of the control loop."""

from dataclasses import dataclass, field


@dataclass(frozen=True)
class LoopParams:
    """The control rate."""

    rate_hz: float = field(
        default=200.0,
        metadata={"low": 20.0, "high": 1000.0, "unit": "Hz", "says": "control rate"},
    )
    park_s: float = field(
        default=4.0,
        metadata={
            "low": 0.0,
            "high": 30.0,
            "unit": "s",
            "says": "longest time for parking before torque goes off",
        },
    )
