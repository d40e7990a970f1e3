"""Parameters of smooth pursuit, vergence and the vestibulo-ocular reflex."""

from dataclasses import dataclass
from typing import Annotated, Literal

from gazerig.params import Bounds


@dataclass(frozen=True)
class PursuitParams:
    """Model, gains, delays and limits of the following.

    Gains and limits are of both models, the delays, the reflex and the fading of the binocular
    controller alone: in gaze space no delay of seeing is left, and the reflex is exact.
    """

    # fmt: off
    model: Annotated[Literal["gaze_space", "binocular", "opposite_angles"],
        "the gaze point follows the predicted target; or the binocular controller of Zhang & Wakamatsu moves the eyes; or they stand "
        "between shifts and turn by the opposite of the head's angles (Nakamoto & Tsuruno 3.4)"] = "gaze_space"
    gain_1_s: Annotated[float, Bounds(0, 50), "rate Kc at which the position error is closed"] = 8.0
    velocity_gain: Annotated[float, Bounds(0, 1), "gain Gp: share of the target's velocity that the eye follows at once; people .95"] = 0.95
    vergence_gain_1_s: Annotated[float, Bounds(0, 50), "rate Kd at which the error in depth is closed"] = 4.0
    divergence_gain_1_s: Annotated[float, Bounds(0, 50), "rate Kdiv instead of Kd if the target is farther away than the gaze point"] = 3.0
    max_speed_deg_s: Annotated[float, Bounds(1, 200), "fastest smooth pursuit, closing of the error included; people 63 deg/s"] = 60.0
    reject_deg_s: Annotated[float, Bounds(1, 1000), "a target reported as faster than this is taken as a jump and not pursued"] = 100.0
    max_error_deg: Annotated[float, Bounds(0.1, 90),
        "the rate of closing applies to at most this error; larger errors are closed no faster"] = 5.0
    delay_ms: Annotated[float, Bounds(0, 500), "binocular: delay tau_c of seeing, the age of a frame included"] = 100.0
    smooth_ms: Annotated[float, Bounds(0.1, 500), "binocular: smoothing Tf of the direction seen"] = 40.0
    vergence_delay_ms: Annotated[float, Bounds(0, 500), "binocular: what vergence is later than that; 60 makes 160 ms in all"] = 60.0
    max_vergence_deg: Annotated[float, Bounds(1, 60), "binocular: largest vergence"] = 20.0
    reflex_gain: Annotated[float, Bounds(0, 1.5), "binocular: gain of the vestibulo-ocular reflex; people .95"] = 1.0
    reflex_delay_ms: Annotated[float, Bounds(0, 100), "binocular: delay of the reflex; people 7-10"] = 10.0
    lost_fade_ms: Annotated[float, Bounds(1, 5000), "binocular: time constant of the eyes' speed when the target is lost"] = 300.0
    # fmt: on
