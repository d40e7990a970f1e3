"""Detections of another process, whose image and depth are copied only on request.

The loop's process never reads most frames: the page shows ten per second, a recording contains two,
and copying all of them takes longer than a tick.
"""

from dataclasses import fields
from typing import Any

from numpy.typing import NDArray

from gazerig.drivers.camera.shared_frames import SlotAddress, SlotReader
from gazerig.drivers.types import Depth, Detections, ImageArray

_OTHERS = tuple(one.name for one in fields(Detections) if one.name not in ("image", "depth_m"))
_UNREAD: Any = object()


class SharedDetections(Detections):
    """Detections with image and depth in shared memory.

    Both are None if they are first read after their slots were overwritten, some frames later; once
    read, they stay.

    Args:
        found: Detections without image and depth.
        image_at: Address of the image; None for none.
        depth_at: Address of the depth; None for none.
        readers: Readers of images and of depths; for any thread.
    """

    __slots__ = ("_addresses", "_depth", "_image", "_readers")
    _addresses: tuple[SlotAddress | None, SlotAddress | None]
    _depth: Any
    _image: Any
    _readers: tuple[SlotReader, SlotReader]

    def __init__(
        self,
        found: Detections,
        image_at: SlotAddress | None,
        depth_at: SlotAddress | None,
        readers: tuple[SlotReader, SlotReader],
    ) -> None:
        put = object.__setattr__  # as a frozen dataclass itself does
        for name in _OTHERS:
            put(self, name, getattr(found, name))
        put(self, "_addresses", (image_at, depth_at))
        put(self, "_readers", readers)
        put(self, "_image", None if image_at is None else _UNREAD)
        put(self, "_depth", None if depth_at is None else _UNREAD)

    @property
    def image(self) -> ImageArray | None:
        """Return the image if it is still available."""
        if self._image is _UNREAD:
            object.__setattr__(self, "_image", self._read(0))
        image: ImageArray | None = self._image
        return image

    @property
    def depth_m(self) -> Depth | None:
        """Return the depth if it is still available."""
        if self._depth is _UNREAD:
            object.__setattr__(self, "_depth", self._read(1))
        depth: Depth | None = self._depth
        return depth

    def _read(self, which: int) -> NDArray[Any] | None:
        address = self._addresses[which]
        return self._readers[which].take(address) if address is not None else None
