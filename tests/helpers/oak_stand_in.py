"""Stand-ins for depthai with one camera: its device, queue and messages."""

from datetime import timedelta
from types import SimpleNamespace

import numpy as np

from gazerig.drivers.camera.oak.discovery import load_depthai
from gazerig.drivers.camera.oak.pipeline import PipelineOutputs
from gazerig.drivers.camera.oak.source import OakSource
from gazerig.drivers.camera.params import OakParams


def real():
    """Return depthai; it takes a second to import, which only who runs these tests waits for."""
    return load_depthai()


def info(device_id="14442C10", name="1.2", status=None):
    return SimpleNamespace(
        deviceId=device_id, name=name, status=status or real().XLinkError_t.X_LINK_SUCCESS
    )


def sdk(free=(), connected=()):
    """Stand in for depthai's list of devices."""

    def everything(state, skipInvalidDevices):  # noqa: N803
        assert skipInvalidDevices is False
        return list(connected)

    return SimpleNamespace(
        Device=SimpleNamespace(getAllAvailableDevices=lambda: list(free)),
        XLinkConnection=SimpleNamespace(getAllConnectedDevices=everything),
        XLinkDeviceState=real().XLinkDeviceState,
        XLinkError_t=real().XLinkError_t,
    )


class Device:
    """The part of a device that is used before a pipeline is made."""

    def __init__(self, speed) -> None:
        self.speed = speed
        sockets = real().CameraBoardSocket
        self.sockets = [sockets.CAM_A, sockets.CAM_B, sockets.CAM_C]
        self.closed = 0
        self.reconnections: int | None = None

    def getUsbSpeed(self):  # noqa: N802
        return self.speed

    def getConnectedCameras(self):  # noqa: N802
        return self.sockets

    def getDeviceName(self):  # noqa: N802
        return "OAK-D"

    def setMaxReconnectionAttempts(self, count):  # noqa: N802
        self.reconnections = count

    def close(self):
        self.closed += 1


class Message:
    """A colour frame with its stamps."""

    def __init__(self, host_s, lens=None, size=(6, 4)) -> None:
        self.host_s = host_s
        self.lens = np.eye(3) if lens is None else lens
        self.width, self.height = size

    def getCvFrame(self):  # noqa: N802
        return np.zeros((self.height, self.width, 3), np.uint8)

    def getTransformation(self):  # noqa: N802
        return SimpleNamespace(getIntrinsicMatrix=lambda: self.lens)

    def getTimestamp(self, offset):  # noqa: N802
        assert offset == real().CameraExposureOffset.MIDDLE
        return timedelta(seconds=self.host_s)


class Group(dict):
    def getMessageNames(self):  # noqa: N802
        return list(self)


class Queue:
    """A queue of given messages; an exception among them is raised."""

    def __init__(self) -> None:
        self.fed: list = []

    def get(self, timeout):
        item = self.fed.pop(0) if self.fed else None
        if isinstance(item, Exception):
            raise item
        return Group(colour=item) if item is not None else None

    def tryGet(self):  # noqa: N802
        return None


class Rig:
    """A complete substitute for depthai with one device."""

    def __init__(self, speed="SUPER", start_fault=None) -> None:
        self.device = Device(getattr(real().UsbSpeed, speed))
        self.queue = Queue()
        rig = self

        class Sync:
            def __init__(self) -> None:
                self.inputs = {"colour": None}
                self.out = SimpleNamespace(createOutputQueue=lambda maxSize, blocking: rig.queue)

            def setRunOnHost(self, wanted):  # noqa: N802
                assert wanted

            def setSyncThreshold(self, threshold):  # noqa: N802
                assert threshold > timedelta(0)

        rig.waited = False  # type: ignore[attr-defined]

        class Pipeline:
            def __init__(self, device) -> None:
                assert device is rig.device

            def create(self, node):
                return node()

            def start(self):
                if start_fault is not None:
                    raise start_fault

            def isRunning(self):  # noqa: N802
                return False

            def wait(self):
                rig.waited = True  # type: ignore[attr-defined]

        self.dai = SimpleNamespace(
            **vars(sdk([info()])),
            UsbSpeed=real().UsbSpeed,
            CameraBoardSocket=real().CameraBoardSocket,
            Pipeline=Pipeline,
            MessageQueue=real().MessageQueue,
            CameraExposureOffset=real().CameraExposureOffset,
            node=SimpleNamespace(Sync=Sync),
        )
        del self.dai.Device

        def device(found):
            return self.device

        device.getAllAvailableDevices = lambda: [info()]  # type: ignore[attr-defined]
        self.dai.Device = device

    def opened(self, **wanted) -> OakSource:
        source = self.source(**wanted)
        source.open()
        return source

    def source(self, **wanted) -> OakSource:
        colour = SimpleNamespace(link=lambda where: None)

        def nodes(dai, pipeline, params) -> PipelineOutputs:
            self.asked = params
            return PipelineOutputs(colour)

        return OakSource(OakParams(**wanted), nodes, True, lambda: self.dai)
