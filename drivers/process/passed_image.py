"""Images passed to another process over a socket, as memory that is passed with the message.

The sender copies an image once and keeps no reference. The memory exists while either process has
its file descriptor open, so a process that dies leaves nothing behind, and no image is overwritten.
"""

import mmap
import os
import socket
import sys
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gazerig.drivers.process.message_link import MessageLink

_FD_BYTES = 4  # a C int
_FD_ROOM = socket.CMSG_LEN(_FD_BYTES)


class PassedImage(NamedTuple):
    """An image that another process can read.

    fd: file descriptor of the pixels' memory; its owner must close it
    shape, dtype: shape and type of the array
    """

    fd: int
    shape: tuple[int, ...]
    dtype: str


def copy_image(image: NDArray[Any]) -> PassedImage:
    """Return a copy of an image in memory that can be passed to a process.

    Raises:
        OSError: no memory or no file descriptors are available.
    """
    fd = os.memfd_create("image")
    try:
        rest = np.ascontiguousarray(image).data.cast("B")
        while rest:
            rest = rest[os.write(fd, rest) :]
    except BaseException:
        os.close(fd)
        raise
    return PassedImage(fd, image.shape, image.dtype.str)


def take_image(image: PassedImage) -> NDArray[Any]:
    """Return the pixels, read-only, and close the file descriptor."""
    try:
        held = mmap.mmap(image.fd, 0, prot=mmap.PROT_READ)
    finally:
        os.close(image.fd)
    return np.frombuffer(held, np.dtype(image.dtype)).reshape(image.shape)


def send(link: MessageLink, message: bytes, fd: int = -1) -> None:
    """Send a message, with a file descriptor unless it is -1.

    Raises:
        OSError: raised by ``socket.send``.
    """
    if fd < 0:
        link.send(message)
    else:
        socket.send_fds(link, [message], [fd])


def receive(link: MessageLink, most: int, flags: int = 0) -> tuple[bytes, int]:
    """Return a message and its file descriptor, -1 without one.

    Raises:
        OSError: raised by ``socket.recv``.
    """
    # socket.recv_fds of Python 3.11 ignores the flags.
    message, beside, _, _ = link.recvmsg(most, _FD_ROOM, flags)
    for level, kind, data in beside:
        if level == socket.SOL_SOCKET and kind == socket.SCM_RIGHTS:
            return message, int.from_bytes(data[:_FD_BYTES], sys.byteorder)
    return message, -1
