"""Tracking of moving patches from image to image, in image coordinates.

Each is expected where its last motion, and the camera's, should have moved it. Nearest pairs are
matched first; a thing must be detected in a few consecutive images before it is reported.
"""

from dataclasses import dataclass

import numpy as np

from gazerig.drivers.vision.motion.flow import Floats, warp_points

# Largest distance from the expected position, in sizes (root of box width times height).
_GATE_SIZES = 0.75
_LEAST_GATE_PX = 5.0
# Largest ratio of the sizes of a matched pair: the visible part of a thing varies, but a person
# does not become a hand.
_LARGEST_GROWTH = 3.0
# Number of consecutive images in which a patch must be detected before it is reported.
_CONFIRMED = 2
# A thing that did not move for longer gets a new id when it moves again.
_FORGET_S = 0.5


@dataclass(slots=True)
class PatchTrack:
    """Track of one patch, in pixels of the small image.

    centre: (2,); velocity_px_s: (2,)
    size_px: root of the box's area
    consecutive_images: number of consecutive images
    """

    id: int
    centre: Floats
    velocity_px_s: Floats
    size_px: float
    seen_s: float
    consecutive_images: int


class MotionTracks:
    """Tracks of moving patches with persistent ids."""

    def __init__(self) -> None:
        self._patch_tracks: list[PatchTrack] = []
        self._next_id = 1

    def step(
        self,
        centres: list[Floats],
        velocities_px_s: list[Floats],
        sizes_px: list[float],
        total: Floats,
        t_s: float,
        dt_s: float,
    ) -> list[PatchTrack]:
        """Match one image's patches to the tracks; return one track for each, in their order.

        total: (3, 3) homography of the camera's own motion, older image to newer
        """
        self.predict(total, t_s, dt_s)
        found: dict[int, PatchTrack] = {}
        taken: set[int] = set()
        # Possible pairs of tracks and patches; their distance is a share of the gate.
        pairs = []
        for i, follow in enumerate(self._patch_tracks):
            for j, centre in enumerate(centres):
                gate = max(_LEAST_GATE_PX, _GATE_SIZES * max(follow.size_px, sizes_px[j]))
                apart = float(np.hypot(*(centre - follow.centre))) / gate
                ratio = max(follow.size_px, 1.0) / max(sizes_px[j], 1.0)
                if apart <= 1.0 and 1.0 / _LARGEST_GROWTH <= ratio <= _LARGEST_GROWTH:
                    pairs.append((apart, i, j))
        for _, i, j in sorted(pairs):
            follow = self._patch_tracks[i]
            if follow.id in taken or j in found:
                continue
            taken.add(follow.id)
            found[j] = follow
        for j, centre in enumerate(centres):
            if j not in found:
                begun = PatchTrack(self._next_id, centre, np.zeros(2), 1.0, t_s, 0)
                self._next_id += 1
                self._patch_tracks.append(begun)
                found[j] = begun
            follow = found[j]
            follow.centre, follow.velocity_px_s = centre, velocities_px_s[j]
            follow.size_px, follow.seen_s = sizes_px[j], t_s
            follow.consecutive_images += 1
        for follow in self._patch_tracks:
            if follow.seen_s < t_s and not self.is_confirmed(follow):
                follow.consecutive_images = 0  # a flicker, not a thing: count again
        return [found[j] for j in range(len(centres))]

    def predict(self, total: Floats, t_s: float, dt_s: float) -> None:
        """Predict every track to ``t_s`` and delete those unseen for too long."""
        self._patch_tracks = [f for f in self._patch_tracks if t_s - f.seen_s <= _FORGET_S]
        for follow in self._patch_tracks:
            follow.centre = warp_points(total, follow.centre[None, :])[0]
            follow.centre = follow.centre + follow.velocity_px_s * dt_s

    def forget(self) -> None:
        """Discard all tracks; ids are not reused."""
        self._patch_tracks = []

    def is_confirmed(self, follow: PatchTrack) -> bool:
        """Return whether a patch has been detected often enough."""
        return follow.consecutive_images >= _CONFIRMED
