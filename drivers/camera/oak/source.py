"""An OAK-D through depthai 3: colour and aligned depth, in host time."""

import threading
from collections.abc import Callable
from contextlib import suppress
from datetime import timedelta
from typing import Any

from gazerig.drivers.camera.oak.discovery import START_CURE, find_oak, load_depthai
from gazerig.drivers.camera.oak.pipeline import (
    COLOUR,
    HEIGHT_PX,
    WIDTH_PX,
    MakeNodes,
    depth_of,
    device_nodes,
    image_of,
    join_outputs,
    lens_of,
)
from gazerig.drivers.camera.params import OakParams
from gazerig.drivers.camera.source import Shot, exposure_s
from gazerig.drivers.errors import CameraError

_SLICE = timedelta(milliseconds=100)  # longest delay of a stop request
_USB2_BYTES_S = 30e6
"""Capacity of a USB 2 line for frames."""
_FRAME_BYTES = WIDTH_PX * HEIGHT_PX * (1.5 + 2.0)
"""Colour (NV12) and depth (RAW16) of one instant."""
_SILENCE_S = 2.0
"""A camera that delivers no frame for longer is lost."""
_LATENCY_S = 0.02
"""Assumed delay from exposure to arrival, where the camera's clock does not follow the host's."""


class OakSource:
    """An OAK-D as a source of frames; nothing is imported or opened before ``open``.

    Args:
        params: Requested settings of the camera.
        nodes: Creates the nodes of the pipeline.
        on_device: False for nodes that all run on the host and need no camera.
        load: Returns the module depthai.
    """

    def __init__(
        self,
        params: OakParams,
        nodes: MakeNodes = device_nodes,
        on_device: bool = True,
        load: Callable[[], Any] = load_depthai,
    ) -> None:
        self._params = params
        self._nodes = nodes
        self._on_device = on_device
        self._load = load
        self._dai: Any = None
        self._device: Any = None
        self._pipeline: Any = None
        self._queue: Any = None
        self._number = 0
        self._events: list[str] = []

    def open(self) -> None:
        """Find the camera, start it, and check its rate.

        Raises:
            CameraError: no camera is found, access is denied, or it is busy.
        """
        self.close()
        self._dai = self._load()
        try:
            if self._on_device:
                info = find_oak(self._dai, self._params.device)
                device = self._dai.Device(info)
                # This program itself reopens a lost camera and reports it.
                device.setMaxReconnectionAttempts(0)
                self._device = device
                self._check_device()
                self._pipeline = self._dai.Pipeline(self._device)
            else:
                self._pipeline = self._dai.Pipeline(createImplicitDevice=False)
            outputs = self._nodes(self._dai, self._pipeline, self._params)
            self._queue = join_outputs(self._dai, self._pipeline, outputs, self._params.rate_hz)
            self._pipeline.start()
        except RuntimeError as error:
            self.close()
            raise CameraError(
                f"the OAK camera cannot be started ({_one_line(error)}): {START_CURE}"
            ) from error
        except BaseException:
            self.close()
            raise
        self._number = 0

    def take(self, now_s: Callable[[], float], stop: threading.Event) -> Shot | None:
        """Wait for the next frame; its time is the middle of its exposure.

        Raises:
            CameraError: the camera is not open, was unplugged or is silent.
        """
        if self._queue is None:
            raise CameraError("the OAK camera is not open: call open() before taking")
        began_s = now_s()
        while not stop.is_set():
            # The newest group of messages; none after a short wait.
            try:
                group = self._queue.tryGet()
                if group is None:
                    group = self._queue.get(_SLICE)
                while group is not None and (newer := self._queue.tryGet()) is not None:
                    group = newer
            except (RuntimeError, self._dai.MessageQueue.QueueException) as error:
                raise CameraError(
                    f"the OAK camera was lost ({_one_line(error)}): check its cable and power supply"
                ) from error
            arrived_s = now_s()
            if group is not None and (shot := self._shot(group, arrived_s)) is not None:
                return shot
            if arrived_s - began_s > _SILENCE_S:
                raise CameraError(
                    f"the OAK camera delivered no frame for {_SILENCE_S:g} s: "
                    "check its cable and power supply"
                )
        return None

    def events(self) -> tuple[str, ...]:
        """Return new events, one line each: USB 2 instead of 3."""
        reported, self._events = tuple(self._events), []
        return reported

    def close(self) -> None:
        """Stop and free the camera; safe to call twice."""
        pipeline, device = self._pipeline, self._device
        self._pipeline = self._device = self._queue = None
        # An unplugged camera raises an error from every call.
        with suppress(RuntimeError):
            if pipeline is not None:
                if pipeline.isRunning():
                    pipeline.stop()
                # Also if the stream has ended already: the destructor would wait for the threads
                # with the interpreter lock, which nodes written in Python need to end.
                pipeline.wait()
        with suppress(RuntimeError):
            if device is not None:
                device.close()

    def __del__(self) -> None:
        """Close a camera that was not closed: the SDK's own destructor would wait forever."""
        self.close()

    def _check_device(self) -> None:
        """Check that the device has a colour camera and a stereo pair, and its USB speed.

        Raises:
            CameraError: a camera is missing.
        """
        socket, found = self._dai.CameraBoardSocket, set(self._device.getConnectedCameras())
        wanted = (socket.CAM_A, socket.CAM_B, socket.CAM_C)
        missing = ", ".join(one.name for one in wanted if one not in found)
        if missing:
            name = self._device.getDeviceName() or "this OAK camera"
            raise CameraError(
                f"{name} has no camera at {missing}: use an OAK-D, with colour and a stereo pair"
            )
        speed, bytes_s = self._device.getUsbSpeed(), _FRAME_BYTES * self._params.rate_hz
        usb = self._dai.UsbSpeed
        if speed in (usb.LOW, usb.FULL, usb.HIGH) and bytes_s > _USB2_BYTES_S:
            self._events.append(
                f"the OAK camera runs at USB 2 speed ({speed.name}), which carries about 30 MB a "
                f"second, and {bytes_s / 1e6:.0f} are requested: use a USB 3 cable (its plug is "
                f"often blue) and port, or set oak.rate_hz {_USB2_BYTES_S / _FRAME_BYTES:.0f}"
            )

    def _shot(self, group: Any, arrived_s: float) -> Shot | None:
        """Convert a group of messages to a frame."""
        image = image_of(group)
        if image is None:
            return None
        self._number += 1
        height, width = image.shape[:2]
        # depthai measures the offset of the clocks by round trips: no transport delay is in its
        # stamp in host time.
        stamp = group[COLOUR].getTimestamp(self._dai.CameraExposureOffset.MIDDLE)
        captured_s = exposure_s(stamp.total_seconds(), arrived_s, _LATENCY_S)
        return Shot(captured_s, self._number, image, depth_of(group, width, height), lens_of(group))


def _one_line(error: BaseException) -> str:
    return " ".join(str(error).split())
