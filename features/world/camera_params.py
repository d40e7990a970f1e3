"""Parameters of a camera in a world: size, rate and fidelity of its pictures."""

from dataclasses import dataclass
from typing import Annotated, Any

from gazerig.params import Bounds


@dataclass(frozen=True)
class WorldCameraParams:
    """Pictures of the rig's camera; its mount and lens come from the rig (section camera)."""

    # fmt: off
    width_px: Annotated[int, Bounds(64, 1920), "width of a picture"] = 320
    height_px: Annotated[int, Bounds(48, 1200), "height of a picture"] = 240
    rate_hz: Annotated[float, Bounds(1, 120), "pictures a second"] = 30.0
    latency_ms: Annotated[float, Bounds(0, 500), "age of a picture when it arrives; simulated time alone"] = 60.0
    depth: Annotated[bool, "distances are measured too, as by a stereo camera"] = False
    depth_noise_1_m: Annotated[float, Bounds(0, 0.2), "error of a distance for each metre squared, metres"] = 0.004
    exposure_ms: Annotated[float, Bounds(0, 100), "how long light is collected; a turning head smears the picture"] = 8.0
    sub_exposures: Annotated[int, Bounds(1, 32), "pictures averaged over an exposure; 1: one, smeared by the turn alone"] = 1
    read_out_ms: Annotated[float, Bounds(0, 100), "from the first row to the last (rolling shutter); 0: all at once"] = 0.0
    bands: Annotated[int, Bounds(2, 64), "bands of rows that a rolling shutter is drawn in"] = 8
    blur_px: Annotated[float, Bounds(0, 10), "blur of the lens: standard deviation in pixels"] = 0.0
    noise_grey: Annotated[float, Bounds(0, 60), "standard deviation of the noise of reading, grey values"] = 3.0
    shot_noise_grey: Annotated[float, Bounds(0, 60), "noise of the light itself where a pixel is white, grey values"] = 0.0
    gain: Annotated[float, Bounds(0.05, 20), "brightness as a multiple; what gets over white is over-exposed"] = 1.0
    gamma: Annotated[float, Bounds(0.2, 5), "exponent of grey values between 0 and 1; above 1: darker middle"] = 1.0
    shadow_px: Annotated[int, Bounds(0, 8192), "side of the shadow map; 0: no shadows"] = 512
    samples: Annotated[int, Bounds(0, 16), "samples a pixel against jagged edges; 0: one"] = 4
    reflections: Annotated[bool, "shiny floors mirror what stands on them"] = False
    # fmt: on

    def of(self, other: type) -> dict[str, Any]:
        """Return the values of those fields that another dataclass of parameters has too."""
        return {name: getattr(self, name) for name in _names(other) & _names(type(self))}


def _names(params: Any) -> set[str]:
    return set(params.__dataclass_fields__)
