"""Face detection that searches some frames and places known faces in all of them.

In every frame known faces are placed at their previous position. New faces come from two searches:
of the whole frame, every few frames and if a face was lost; and, in the frames between, of one tile
of the frame after another, for far faces. So all frames take about the same time.

YuNet searches if its file is present, and MTCNN too in every fourth search, as it finds tilted and
drawn faces better. MTCNN also places landmarks more accurately. Either of them is enough. While a
face is there that only YuNet finds, YuNet searches every frame.
"""

from functools import cache, partial
from math import ceil

import numpy as np

from gazerig.drivers.errors import ModelFileError
from gazerig.drivers.event_log import EventLog
from gazerig.drivers.types import DetectedFace, ImageArray
from gazerig.drivers.vision.face.mtcnn import MtcnnDetector
from gazerig.drivers.vision.face.params import MIN_CONFIDENCE, MIN_FACE_PX, FaceDetectorParams
from gazerig.drivers.vision.face.preprocess import (
    FoundFace,
    Tile,
    improve_contrast,
    new_faces,
    sort_by_size,
    whole_image,
)
from gazerig.drivers.vision.face.yunet import YunetDetector
from gazerig.drivers.vision.mouth import with_mouth

# Ratio of neighbouring scales: a network for 12 pixels also finds faces of 20.
_SHRINK = 0.6
# Approximate size of a tile in pixels of its scale, and its overlap with the next one: a face of 20
# pixels is complete in one of them.
_TILE_PX, _SHARED_PX = 160, 24
# Largest enlargement of a frame to find small faces; more would show no more detail.
_MOST_ENLARGED = 1.2
# Width of the frame in which far faces of 12 pixels are searched, tile by tile.
_FAR_WIDTH_PX = 768
# Smallest face that a network finds.
_LEAST_PX = 12


@cache
def far_tiles(width_px: int, height_px: int, near_scale: float) -> tuple[Tile, ...]:
    """Return the tiles to search for faces that are too small for the search of the whole frame.

    Args:
        width_px: Width of the frame.
        height_px: Height of the frame.
        near_scale: Scale at which the search of the whole frame begins.

    Returns:
        Tiles, those for the largest faces first.
    """
    tiles: list[Tile] = []
    scale = min(_FAR_WIDTH_PX / width_px, _MOST_ENLARGED)
    while scale > near_scale / _SHRINK**0.5:
        if min(width_px, height_px) * scale >= _LEAST_PX:
            # Tiles of equal size cover the frame at one scale.
            across, down = _tile_spans(width_px, scale), _tile_spans(height_px, scale)
            width = round((across[0][1] - across[0][0]) * scale)
            height = round((down[0][1] - down[0][0]) * scale)
            level = [Tile(x0, y0, x1, y1, width, height) for y0, y1 in down for x0, x1 in across]
            tiles = [*level, *tiles]
        scale *= _SHRINK
    return tuple(tiles)


def _tile_spans(length_px: int, scale: float) -> list[tuple[int, int]]:
    """Return equal, overlapping spans that cover a length in pixels of the frame."""
    scaled = length_px * scale
    count = max(1, ceil((scaled - _SHARED_PX) / (_TILE_PX - _SHARED_PX)))
    side = min(length_px, ceil((scaled + (count - 1) * _SHARED_PX) / count / scale))
    if count == 1:
        return [(0, length_px)]
    starts = [round(i * (length_px - side) / (count - 1)) for i in range(count)]
    return [(start, start + side) for start in starts]


# A known face is dropped when its confidence falls below this.
_KEEP_CONFIDENCE = 0.5
# Number of frames between two searches of the whole frame; and while no face is known.
_SEARCH_EVERY, _SEARCH_SOON = 4, 2
# With YuNet, every n-th search is also MTCNN's.
_MTCNN_EVERY = 4
# A far face needs a higher confidence than a near one, as a few pixels can resemble a face.
_FAR_CONFIDENCE = 0.9


class AutoDetector:
    """Detector of faces with five landmarks, which stores those of the previous frame.

    searched: whether the last frame was searched as a whole; not by YuNet for a lost face alone,
        which takes a third of the time
    """

    def __init__(self, params: FaceDetectorParams) -> None:
        """Load the networks; one that is damaged is reported, and the other searches.

        Raises:
            ModelFileError: neither can be loaded.
        """
        self._params, self._log = params, EventLog()
        self._networks: list[MtcnnDetector | YunetDetector] = []
        for load, other in ((partial(MtcnnDetector, params), "yunet"), (YunetDetector, "mtcnn")):
            try:
                self._networks.append(load())
            except FileNotFoundError:
                pass  # YuNet's file is optional
            except ModelFileError as error:
                self._log.add(f"{error}; until then {other} finds the faces")
        if not self._networks:
            raise ModelFileError("; ".join(self._log.drain()))
        self._known: list[FoundFace] = []
        self._size: tuple[int, ...] = ()
        self._since_search, self._searches, self._next_tile = 0, 0, 0

    def find(self, image: ImageArray) -> tuple[DetectedFace, ...]:
        """Return faces, the largest first, in pixels of the image."""
        if image.size == 0:
            return ()
        frame = improve_contrast(image)
        first = frame.shape != self._size
        self._size = frame.shape
        if first:
            self._known = []
        height, width = frame.shape[:2]
        near = min(1.0, self._params.work_width_px / width) * _LEAST_PX / MIN_FACE_PX
        tiles = far_tiles(width, height, near)
        known = self._track_faces(frame)
        is_lost = len(known) < len(self._known)
        self._since_search += 1
        every = _SEARCH_EVERY if known else _SEARCH_SOON
        self.searched = first or self._since_search >= every
        if self.searched or is_lost:
            self._since_search = 0
            self._searches += 1
            networks = self._networks[-1:]
            if first or self._searches % _MTCNN_EVERY == 0:
                networks = self._networks
            self.searched |= networks == self._networks
            tile = whole_image(frame, self._params.work_width_px)
            for network in networks:
                found = network.search(frame, tile, known, MIN_CONFIDENCE)
                known += self._place_found(frame, found, known)
        if not first:
            self._next_tile = (self._next_tile + 1) % max(1, len(tiles))
            tiles = tiles[self._next_tile : self._next_tile + 1] if not self.searched else ()
        for tile in tiles:
            known += self._networks[0].search(frame, tile, known, _FAR_CONFIDENCE)
        self._known = known
        return sort_by_size([with_mouth(image, one.face) for one in known])

    def events(self) -> tuple[str, ...]:
        """Return the events since the last call, one line each."""
        return self._log.drain()

    def _track_faces(self, frame: ImageArray) -> list[FoundFace]:
        """Return the faces of MTCNN that are still present, placed in this frame."""
        known = [one for one in self._known if one.by_mtcnn]
        boxes = np.array([one.box for one in known])
        placed = self._networks[0].place(frame, boxes, _KEEP_CONFIDENCE)
        found = []
        for one, now in zip(known, placed, strict=True):
            if now is not None:
                # The search box is predicted by the motion between frames: the network places a
                # face that is off the centre of its box too near to that centre.
                moved = (now.face.landmarks_px - one.face.landmarks_px).mean(axis=0)
                found.append(now._replace(box=now.box + np.tile(moved, 2)))
        return new_faces(found, [])

    def _place_found(
        self, frame: ImageArray, found: list[FoundFace], known: list[FoundFace]
    ) -> list[FoundFace]:
        """Return found faces, placed by MTCNN where it finds them too."""
        if all(one.by_mtcnn for one in found):
            return found
        placed = self._networks[0].place(
            frame, np.array([one.box for one in found]), MIN_CONFIDENCE
        )
        return new_faces([now or one for one, now in zip(found, placed, strict=True)], known)
