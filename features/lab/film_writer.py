"""Films for browsers: WebM with VP8, which all current browsers play."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from fractions import Fraction
from pathlib import Path

import av

from gazerig.drivers.errors import SetupError
from gazerig.drivers.types import ImageArray

_BITS_PER_S = 2_000_000
_OPTIONS = {"deadline": "good", "auto-alt-ref": "0"}


@contextmanager
def film_writer(
    path: Path, size_px: tuple[int, int], rate_hz: float
) -> Iterator[Callable[[ImageArray], None]]:
    """Yield a function that appends BGR pictures to a film.

    Args:
        path: Path of the film, ending in .webm; an existing file is overwritten.
        size_px: Width and height of all pictures.
        rate_hz: Pictures per second.

    Raises:
        SetupError: the file cannot be written.
    """
    try:
        container = av.open(str(path), "w")
    except (av.FFmpegError, OSError) as error:
        raise SetupError(f"cannot write the film {path} ({error}): name another file") from error
    with container:
        rate = Fraction(rate_hz).limit_denominator(1000)
        stream = container.add_stream("libvpx", rate=rate, options=_OPTIONS)
        stream.width, stream.height = size_px
        stream.pix_fmt, stream.bit_rate = "yuv420p", _BITS_PER_S

        def write(picture: ImageArray) -> None:
            container.mux(stream.encode(av.VideoFrame.from_ndarray(picture, format="bgr24")))

        yield write
        container.mux(stream.encode())
