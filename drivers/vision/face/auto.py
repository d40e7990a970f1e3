"""Face detection that searches some frames and places known faces in all of them.

In every frame the last network of MTCNN scores each known face at its previous position and places
its landmarks; a face that is no longer there is searched nearby. New faces come from two searches:
of the whole frame, every few frames, with YuNet if its file is present, otherwise with MTCNN; and,
in the frames between, of one tile of the frame after another, for far faces. So all frames take
about the same time.
"""

from functools import cache
from math import ceil
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from gazerig.drivers.errors import ModelFileError
from gazerig.drivers.event_log import EventLog
from gazerig.drivers.types import DetectedFace, ImageArray
from gazerig.drivers.vision.face.mtcnn import (
    WINDOW_PX,
    Floats,
    MtcnnNetworks,
    face_of,
    overlap_shares,
    propose_faces,
    to_squares,
)
from gazerig.drivers.vision.face.params import MIN_CONFIDENCE, MIN_FACE_PX, FaceDetectorParams
from gazerig.drivers.vision.face.preprocess import (
    PreparedImage,
    as_bgr,
    crop_square,
    prepare,
    sort_by_size,
)
from gazerig.drivers.vision.face.yunet import YunetNetwork, face_of_row
from gazerig.drivers.vision.model_files import yunet_file

# Ratio of neighbouring scales: a network for 12 pixels also finds faces of 20.
_SHRINK = 0.6
# Approximate size of a tile in pixels of its scale, and its overlap with the next one: a face of 20
# pixels is complete in one of them.
_TILE_PX, _SHARED_PX = 160, 24
# Largest enlargement of a frame to find small faces; more would show no more detail.
_MOST_ENLARGED = 1.2
# Width of the frame in which far faces of 12 pixels are searched, tile by tile.
_FAR_WIDTH_PX = 768


class Tile(NamedTuple):
    """A part of a frame and the size at which it is searched.

    left, top, right, bottom: edges in pixels of the frame
    width_px, height_px: its size after scaling
    """

    left: int
    top: int
    right: int
    bottom: int
    width_px: int
    height_px: int


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
        if min(width_px, height_px) * scale >= WINDOW_PX:
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


# Confidence threshold of MTCNN's first network in a tile. At 0.8 twice as many pass, without
# finding more faces.
_PROPOSE_AT = 0.9
# A known face is dropped when its confidence falls below this.
_KEEP_CONFIDENCE = 0.5
# Number of frames between two searches of the whole frame; and while no face is known.
_SEARCH_EVERY, _SEARCH_SOON = 4, 2
# A far face needs a higher confidence than a near one, as a few pixels can resemble a face.
_FAR_CONFIDENCE = 0.9
# Common share of the smaller of two boxes above which they are the same face.
_SAME = 0.5
# Square in which a lost face is searched: factor on its own square, and size in pixels at which the
# first network works best.
_AROUND, _AROUND_PX = 2.6, 40
# Square in which YuNet scores a face that only it finds: factor on its own square, and size in
# pixels.
_YUNET_AROUND, _YUNET_PX = 2.0, 96
# Half the side of the last network's square, in root mean square distances of the five landmarks
# from their centre, and its offset above that centre.
_SQUARE, _ABOVE = 2.1, 0.13
# With YuNet, MTCNN also runs in every n-th search, as it finds tilted and drawn faces better.
_BOTH_EVERY = 4
# Mean change in grey levels above which a frame is another shot; rows and columns sampled.
_CUT_GREY, _SAMPLES = 30.0, 24


class _KnownFace(NamedTuple):
    """A face of the previous frame.

    box: (4,) square in which it is searched next, in pixel edges
    by_yunet: whether only YuNet finds it
    """

    box: Floats
    face: DetectedFace
    by_yunet: bool


class AutoDetector:
    """Detector of faces with five landmarks, which stores those of the previous frame."""

    def __init__(self, params: FaceDetectorParams) -> None:
        """Load the networks; an invalid YuNet file is reported, and MTCNN searches instead.

        Raises:
            ModelFileError: MTCNN's package or one of its files is missing or altered.
        """
        self._params = params
        self._log = EventLog()
        self._networks = MtcnnNetworks()
        self._yunet: YunetNetwork | None = None
        if file := params.model_file or yunet_file():
            try:
                self._yunet = YunetNetwork(file)
            except ModelFileError as error:
                self._log.add(f"{error}; until then mtcnn finds the faces")
        self._known: list[_KnownFace] = []
        self._size: tuple[int, ...] = ()
        self._samples = np.zeros(0)
        self._since_search, self._searches, self._next_tile = 0, 0, 0

    def find(self, image: ImageArray) -> tuple[DetectedFace, ...]:
        """Return faces, the largest first, in pixels of the image."""
        frame = as_bgr(image)
        if frame.size == 0:
            return ()
        first = frame.shape != self._size
        self._size = frame.shape
        if first:
            self._known = []
        height, width = frame.shape[:2]
        near = min(1.0, self._params.work_width_px / width) * WINDOW_PX / MIN_FACE_PX
        tiles = far_tiles(width, height, near)
        known = self._track_faces(frame)
        soon = len(known) < len(self._known) or self._is_cut(frame)
        self._since_search += 1
        every = _SEARCH_SOON if soon or not known else _SEARCH_EVERY
        if first or self._since_search >= every:
            self._since_search = 0
            prepared = prepare(frame, self._params.work_width_px)
            assert prepared is not None
            self._searches += 1
            found: list[_KnownFace] = []
            if self._yunet is not None:
                found += self._search_frame_by_yunet(self._yunet, prepared, known)
            if self._yunet is None or first or self._searches % _BOTH_EVERY == 0:
                boxes = propose_faces(self._networks, prepared)
                boxes = self._networks.refine(frame, boxes[_is_new(boxes, [*known, *found])])
                least = MIN_CONFIDENCE
                found += self._confirm_new_faces(frame, [*known, *found], boxes, least)
            known += found
        elif tiles:
            self._next_tile = (self._next_tile + 1) % len(tiles)
            known += self._search_tile(frame, known, tiles[self._next_tile])
        for tile in tiles if first else ():
            known += self._search_tile(frame, known, tile)
        self._known = known
        return sort_by_size([one.face for one in known])

    def events(self) -> tuple[str, ...]:
        """Return the events since the last call, one line each."""
        return self._log.drain()

    def _is_cut(self, frame: ImageArray) -> bool:
        """Return whether a frame shows another shot than the previous one."""
        height, width = frame.shape[:2]
        rows, columns = max(1, height // _SAMPLES), max(1, width // _SAMPLES)
        samples = frame[::rows, ::columns, 1].astype(np.float64)
        before, self._samples = self._samples, samples
        return before.shape == samples.shape and float(np.abs(samples - before).mean()) > _CUT_GREY

    def _track_faces(self, frame: ImageArray) -> list[_KnownFace]:
        """Return the known faces that are still present, placed in this frame."""
        if not self._known:
            return []
        boxes = np.array([one.box for one in self._known])
        judged = self._place_faces(frame, boxes, _KEEP_CONFIDENCE)
        for row, (one, now) in enumerate(zip(self._known, judged, strict=True)):
            if now is None:
                around = None if one.by_yunet else self._search_around(frame, one)
                judged[row] = around or self._place_by_yunet(frame, one)
            else:
                # The search box is predicted by the motion between frames: the network places a
                # face that is off the centre of its box too near to that centre.
                moved = (now.face.landmarks_px - one.face.landmarks_px).mean(axis=0)
                judged[row] = now._replace(box=now.box + np.tile(moved, 2))
        return _new_faces([one for one in judged if one is not None], [])

    def _place_faces(
        self, frame: ImageArray, boxes: Floats, least: float
    ) -> list[_KnownFace | None]:
        """Return the face in each square box, None if the last network finds none."""
        placed = self._networks.place(frame, boxes)
        again = to_squares(placed.boxes)
        return [
            _KnownFace(again[row], face_of(placed, row), False) if score >= least else None
            for row, score in enumerate(placed.scores)
        ]

    def _search_around(self, frame: ImageArray, one: _KnownFace) -> _KnownFace | None:
        """Search for a lost face around its previous position."""
        part, where = crop_square(frame, _widen(one.box, _AROUND), _AROUND_PX)
        boxes, _ = self._networks.propose(part, _PROPOSE_AT)
        boxes = boxes * ((where[2] - where[0]) / _AROUND_PX) + np.tile(where[:2], 2)
        boxes = self._networks.refine(frame, to_squares(boxes))
        found = [face for face in self._place_faces(frame, boxes, MIN_CONFIDENCE) if face]
        return max(found, key=lambda face: face.face.confidence, default=None)

    def _place_by_yunet(self, frame: ImageArray, one: _KnownFace) -> _KnownFace | None:
        """Place a face that only YuNet finds."""
        if self._yunet is None:
            return None
        part, where = crop_square(frame, _widen(one.box, _YUNET_AROUND), _YUNET_PX)
        rows = self._yunet.search(part, _KEEP_CONFIDENCE)
        if not len(rows):
            return None
        row = rows[np.argmax(rows[:, 14])]
        row[:14] *= (where[2] - where[0]) / _YUNET_PX
        row[:2] += where[:2]
        row[4:14] += np.tile(where[:2], 5)
        return _KnownFace(_landmark_square(row[4:14].reshape(5, 2)), face_of_row(row), True)

    def _search_frame_by_yunet(
        self, yunet: YunetNetwork, prepared: PreparedImage, known: list[_KnownFace]
    ) -> list[_KnownFace]:
        """Search the whole frame with YuNet; MTCNN's last network places faces it also finds."""
        least = MIN_CONFIDENCE
        rows = yunet.search(prepared.working_size, least)
        rows[:, :14] *= np.tile(prepared.full_per_working, 7)
        points = rows[:, 4:14].reshape(-1, 5, 2)
        boxes = np.array([_landmark_square(five) for five in points]).reshape(-1, 4)
        fresh = np.flatnonzero(_is_new(boxes, known))
        judged = self._place_faces(prepared.full_size, boxes[fresh], least)
        found = [
            now if now is not None else _KnownFace(boxes[row], face_of_row(rows[row]), True)
            for row, now in zip(fresh, judged, strict=True)
        ]
        return _new_faces(found, known)

    def _search_tile(
        self, frame: ImageArray, known: list[_KnownFace], tile: Tile
    ) -> list[_KnownFace]:
        """Search a tile for small faces; return the new ones."""
        part = frame[tile.top : tile.bottom, tile.left : tile.right]
        size = tile.width_px, tile.height_px
        way = cv2.INTER_AREA if part.shape[1] > tile.width_px else cv2.INTER_LINEAR
        scaled = np.asarray(cv2.resize(part, size, interpolation=way), np.uint8)
        boxes, _ = self._networks.propose(scaled, _PROPOSE_AT)
        stretch = part.shape[1] / tile.width_px, part.shape[0] / tile.height_px
        boxes = boxes * np.tile(stretch, 2) + (tile.left, tile.top, tile.left, tile.top)
        boxes = to_squares(boxes)
        boxes = self._networks.refine(frame, boxes[_is_new(boxes, known)])
        return self._confirm_new_faces(frame, known, boxes, _FAR_CONFIDENCE)

    def _confirm_new_faces(
        self, frame: ImageArray, known: list[_KnownFace], boxes: Floats, least: float
    ) -> list[_KnownFace]:
        """Return the new faces in square boxes that the last network confirms."""
        found = [one for one in self._place_faces(frame, boxes, least) if one is not None]
        return _new_faces(found, known)


def _widen(box: Floats, times: float) -> Floats:
    """Return a square with the same centre, wider by a factor."""
    middle, half = (box[:2] + box[2:]) / 2.0, times * (box[2] - box[0]) / 2.0
    return np.concatenate([middle - half, middle + half])


def _landmark_square(points: Floats) -> Floats:
    """Return the square in which the last network best detects a face with these landmarks."""
    middle = points.mean(axis=0)
    spread = float(np.sqrt(((points - middle) ** 2).sum(axis=1).mean()))
    middle = middle - (0.0, _ABOVE * spread)
    return np.concatenate([middle - _SQUARE * spread, middle + _SQUARE * spread])


def _is_new(boxes: Floats, known: list[_KnownFace]) -> NDArray[np.bool_]:
    """Return a mask of the boxes that are not those of known faces."""
    others = np.array([one.box for one in known]).reshape(-1, 4)
    return np.asarray(~(overlap_shares(boxes, others) > _SAME).any(axis=1))


def _new_faces(found: list[_KnownFace], known: list[_KnownFace]) -> list[_KnownFace]:
    """Return the found faces that are not known and not duplicates of a more confident one."""
    kept: list[_KnownFace] = []
    for one in sorted(found, key=lambda face: (face.by_yunet, -face.face.confidence)):
        if _is_new(one.box[np.newaxis], [*known, *kept])[0]:
            kept.append(one)
    return kept
