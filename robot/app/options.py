"""What to run: wires or emulation, what to look at, which clock, which dice."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal


@dataclass(frozen=True)
class Choice:
    """What to run.

    Exactly one of scene, video, camera, oak and replay is set.
    pixels: the scene is drawn and looked at by the real detectors
    port: serial port instead of the rig's
    placed_by: pictures are placed by the head's pose at their capture, or, for comparison
        only, by the newest pose, which makes the head overshoot
    """

    mock: bool
    fast: bool
    seed: int
    scene: str | None = None
    video: Path | None = None
    camera: int | None = None
    oak: bool = False
    replay: Path | None = None
    pixels: bool = False
    scanpath: str | None = None
    saccade: str | None = None
    rules: str | None = None
    port: str | None = None
    film_delay_s: float = 0.05
    placed_by: Literal["capture", "newest"] = "capture"

    @property
    def eyes(self) -> str | None:
        """Say what a real or filmed camera is, None for a scene."""
        if self.video is not None:
            return "a film"
        if self.replay is not None:
            return "a recording"
        if self.camera is not None:
            return "a webcam"
        return "an OAK-D" if self.oak else None
