"""An OAK-D through depthai 3: colour and aligned depth, in host time."""

import threading
from collections.abc import Callable
from datetime import timedelta
from typing import Any

from gazerig.drivers.camera.oak.discovery import find_oak, load_depthai, start_cure
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
from gazerig.drivers.camera.source import Shot
from gazerig.drivers.errors import CameraError

_SLICE = timedelta(milliseconds=100)  # longest delay of a stop request
# The camera's stamp in host time is used if it is not older than this and not in the future.
_OLDEST_STAMP_S = 1.0

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
        self._in_step = True
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
                self._prepare()
                self._pipeline = self._dai.Pipeline(self._device)
            else:
                self._pipeline = self._dai.Pipeline(createImplicitDevice=False)
            outputs = self._nodes(self._dai, self._pipeline, self._params)
            self._queue = join_outputs(self._dai, self._pipeline, outputs, self._params.rate_hz)
            self._pipeline.start()
        except RuntimeError as error:
            self.close()
            text = _one_line(error)
            raise CameraError(
                f"the OAK camera cannot be started ({text}): {start_cure(text)}"
            ) from error
        except BaseException:
            self.close()
            raise
        self._in_step, self._number = True, 0

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
        """Return new events, one line each: USB 2 instead of 3, a clock out of step."""
        reported, self._events = tuple(self._events), []
        return reported

    def close(self) -> None:
        """Stop and free the camera; safe to call twice."""
        pipeline, device = self._pipeline, self._device
        self._pipeline = self._device = self._queue = None
        # An unplugged camera raises an error from every call.
        for end in (_create_end(pipeline), device.close if device is not None else None):
            if end is not None:
                try:
                    end()
                except RuntimeError as error:
                    self._events.append(f"closing the OAK camera: {_one_line(error)}")

    def __del__(self) -> None:
        """Close a camera that was not closed: the SDK's own destructor would wait forever."""
        self.close()

    def _prepare(self) -> None:
        """Check the device's cameras and USB speed."""
        self._check_cameras()
        speed = self._device.getUsbSpeed()
        slow = (self._dai.UsbSpeed.LOW, self._dai.UsbSpeed.FULL, self._dai.UsbSpeed.HIGH)
        if speed in slow and _FRAME_BYTES * self._params.rate_hz > _USB2_BYTES_S:
            self._events.append(_usb2_text(self._params, speed.name))

    def _check_cameras(self) -> None:
        """Check that the device has a colour camera and a stereo pair.

        Raises:
            CameraError: it has not.
        """
        socket, found = self._dai.CameraBoardSocket, set(self._device.getConnectedCameras())
        wanted = (socket.CAM_A, socket.CAM_B, socket.CAM_C)
        missing = ", ".join(one.name for one in wanted if one not in found)
        if missing:
            name = self._device.getDeviceName() or "this OAK camera"
            raise CameraError(
                f"{name} has no camera at {missing}: use an OAK-D, with colour and a stereo pair"
            )

    def _shot(self, group: Any, arrived_s: float) -> Shot | None:
        """Convert a group of messages to a frame."""
        image = image_of(group)
        if image is None:
            return None
        self._number += 1
        height, width = image.shape[:2]
        captured_s = self._captured_s(group[COLOUR], arrived_s)
        return Shot(captured_s, self._number, image, depth_of(group, width, height), lens_of(group))

    def _captured_s(self, frame: Any, arrived_s: float) -> float:
        """Return the host time of a frame's exposure.

        depthai measures the offset of the clocks by round trips, so its stamp in host time contains
        no transport delay. If the stamp is implausible, times of arrival are used.
        """
        stamped_s = frame.getTimestamp(self._dai.CameraExposureOffset.MIDDLE).total_seconds()
        if 0.0 <= arrived_s - stamped_s <= _OLDEST_STAMP_S:
            return float(stamped_s)
        if self._in_step:
            self._in_step = False
            self._events.append(
                "the OAK camera's clock is not synchronised with the host's: arrival times minus "
                f"{1e3 * _LATENCY_S:g} ms are used"
            )
        return arrived_s - _LATENCY_S


def _create_end(pipeline: Any) -> Callable[[], None] | None:
    """Return a function that stops a pipeline and waits for its threads."""
    if pipeline is None:
        return None

    def end() -> None:
        if pipeline.isRunning():
            pipeline.stop()
        # Also if the stream has ended already: the destructor would wait for the threads with the
        # interpreter lock, which nodes written in Python need to end.
        pipeline.wait()

    return end


def _one_line(error: BaseException) -> str:
    """Return an error's text on one line."""
    return " ".join(str(error).split())


def _usb2_text(params: OakParams, speed: str) -> str:
    """Return a message about the effect of a USB 2 line on the requested frames."""
    return (
        f"the OAK camera runs at USB 2 speed ({speed}), which carries about 30 MB a second, and "
        f"{_FRAME_BYTES * params.rate_hz / 1e6:.0f} are requested: use a USB 3 cable (its plug is "
        f"often blue) and port, or set oak.rate_hz {_USB2_BYTES_S / _FRAME_BYTES:.0f}"
    )
