"""Which camera is taken, and what is said where none can be; device calls are stood in for."""

import gc
import threading
from datetime import timedelta
from types import SimpleNamespace

import numpy as np
import pytest

from gazerig.drivers.camera.oak.discovery import UDEV_RULE, find_oak
from gazerig.drivers.camera.oak.params import OakParams
from gazerig.drivers.camera.oak.pipeline import Outputs
from gazerig.drivers.camera.oak.sdk import load_depthai
from gazerig.drivers.camera.oak.source import OakSource
from gazerig.drivers.errors import CameraError


def real():
    """Return depthai; it takes a second to import, which only who runs these tests waits for."""
    return load_depthai()


def info(device_id="14442C10", name="1.2", status=None):
    return SimpleNamespace(
        deviceId=device_id, name=name, status=status or real().XLinkError_t.X_LINK_SUCCESS
    )


def no_rights():
    return real().XLinkError_t.X_LINK_INSUFFICIENT_PERMISSIONS


def sdk(free=(), connected=()):
    """Stand in for what depthai says of the devices there are."""

    def everything(state, skipInvalidDevices):  # noqa: N803
        assert skipInvalidDevices is False
        return list(connected)

    return SimpleNamespace(
        Device=SimpleNamespace(getAllAvailableDevices=lambda: list(free)),
        XLinkConnection=SimpleNamespace(getAllConnectedDevices=everything),
        XLinkDeviceState=real().XLinkDeviceState,
        XLinkError_t=real().XLinkError_t,
    )


def test_first_free_camera_is_taken(tmp_path):
    one, two = info("AA", "1.1"), info("BB", "1.2")
    assert find_oak(sdk([one, two]), usb=tmp_path) is one
    assert find_oak(sdk([one, two]), "BB", tmp_path) is two
    assert find_oak(sdk([one, two]), "1.2", tmp_path) is two


def test_no_camera_says_what_to_look_at(tmp_path):
    with pytest.raises(CameraError, match="no OAK camera found: plug it in with a USB 3 cable"):
        find_oak(sdk(), usb=tmp_path)


def test_real_sdk_without_a_camera_says_the_same(tmp_path):
    if real().Device.getAllAvailableDevices():
        pytest.skip("an OAK camera is plugged in")
    with pytest.raises(CameraError, match="no OAK camera"):
        find_oak(real(), usb=tmp_path)


@pytest.mark.parametrize("listed_free", [True, False])
def test_camera_without_rights_gives_the_udev_rule(tmp_path, listed_free):
    forbidden = [info(status=no_rights())]
    dai = sdk(forbidden if listed_free else [], forbidden)
    with pytest.raises(CameraError) as caught:
        find_oak(dai, usb=tmp_path)
    assert UDEV_RULE in str(caught.value) and "80-movidius.rules" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_camera_that_only_the_system_sees_gives_the_udev_rule(tmp_path):
    for port, vendor in (("1-1", "046d\n"), ("1-2", "03e7\n")):
        (tmp_path / port).mkdir()
        (tmp_path / port / "idVendor").write_text(vendor)
    with pytest.raises(CameraError, match="udevadm trigger"):
        find_oak(sdk(), usb=tmp_path)


def test_camera_in_use_is_named(tmp_path):
    with pytest.raises(CameraError, match="OAK camera AA is in use: end the other program"):
        find_oak(sdk(connected=[info("AA")]), usb=tmp_path)


def test_wrong_name_lists_what_there_is(tmp_path):
    with pytest.raises(CameraError, match="no OAK camera 'CC' .there is: AA, BB."):
        find_oak(sdk([info("AA")], [info("BB")]), "CC", tmp_path)


class Device:
    """The part of a device that is asked before a pipeline is made."""

    def __init__(self, speed) -> None:
        self.speed = speed
        self.closed = 0
        self.reconnections: int | None = None
        self.dots = 0.0

    def getUsbSpeed(self):  # noqa: N802
        return self.speed

    def setMaxReconnectionAttempts(self, count):  # noqa: N802
        self.reconnections = count

    def setIrLaserDotProjectorIntensity(self, share):  # noqa: N802
        self.dots = share

    def close(self):
        self.closed += 1


class Message:
    """A colour frame with its stamps."""

    def __init__(self, device_s, host_s) -> None:
        self.device_s, self.host_s = device_s, host_s

    def getCvFrame(self):  # noqa: N802
        return np.zeros((4, 6, 3), np.uint8)

    def getTransformation(self):  # noqa: N802
        return SimpleNamespace(getIntrinsicMatrix=lambda: np.eye(3))

    def getTimestampDevice(self, offset):  # noqa: N802
        assert offset == real().CameraExposureOffset.MIDDLE
        return timedelta(seconds=self.device_s)

    def getTimestamp(self, offset):  # noqa: N802
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
    """A whole stand-in for depthai with one device."""

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

    def source(self, **wanted) -> OakSource:
        colour = SimpleNamespace(link=lambda where: None)
        return OakSource(
            OakParams(**wanted),
            lambda dai, pipeline, params: Outputs(colour),
            True,
            lambda: self.dai,
        )


def test_usb_2_is_told():
    rig = Rig("HIGH")
    source = rig.source()
    source.open()
    (reported,) = source.events()
    assert "USB 2 speed (HIGH)" in reported and "USB 3 cable" in reported
    assert source.events() == ()


def test_usb_2_is_refused_where_that_is_wanted():
    rig = Rig("FULL")
    with pytest.raises(CameraError, match="USB 2 speed"):
        rig.source(usb2="refuse").open()
    assert rig.device.closed


def test_usb_3_is_no_matter_and_the_dots_are_lit():
    rig = Rig("SUPER")
    source = rig.source(dot_projector=0.4)
    source.open()
    assert source.events() == ()
    assert (rig.device.dots, rig.device.reconnections) == (0.4, 0)
    source.close()
    assert rig.device.closed == 1


def test_camera_that_does_not_start_is_freed_and_named():
    rig = Rig(start_fault=RuntimeError("X_LINK_DEVICE_ALREADY_IN_USE\nsomewhere"))
    with pytest.raises(CameraError, match="X_LINK_DEVICE_ALREADY_IN_USE somewhere.*unplug") as it:
        rig.source().open()
    assert "\n" not in str(it.value)
    assert rig.waited and rig.device.closed == 1  # type: ignore[attr-defined]


def test_camera_that_is_dropped_open_is_closed():
    rig = Rig()
    source = rig.source()
    source.open()
    held: list[object] = [source]
    held.append(held)  # as the frames of a traceback hold it: only the garbage collector finds it
    del source, held
    gc.collect()
    assert rig.waited and rig.device.closed == 1  # type: ignore[attr-defined]


def take(rig, source, clock, *messages):
    rig.queue.fed.extend(messages)
    return [source.take(clock, threading.Event()) for _ in messages]


def test_unplugged_camera_is_lost():
    rig = Rig()
    source = rig.source()
    source.open()
    rig.queue.fed.append(real().XLinkReadError("Couldn't read data from stream"))
    with pytest.raises(CameraError, match="was lost .Couldn't read data"):
        source.take(lambda: 0.0, threading.Event())


def test_stamps_in_step_with_the_host_are_used():
    rig = Rig()
    source = rig.source()
    source.open()
    first, second = take(rig, source, lambda: 100.1, Message(5.0, 100.03), Message(5.033, 100.064))
    assert first.captured_s == pytest.approx(100.03)
    assert second.captured_s == pytest.approx(100.063)
    assert source.events() == ()


@pytest.mark.parametrize("stamp_s", [100.5, 90.0, 0.0])
def test_stamps_out_of_step_give_way_to_arrivals(stamp_s):
    rig = Rig()
    source = rig.source(latency_ms=30.0)
    source.open()
    (shot,) = take(rig, source, lambda: 100.1, Message(5.0, stamp_s))
    assert shot.captured_s == pytest.approx(100.07)
    (reported,) = source.events()
    assert "not in step" in reported and "30 ms (latency_ms)" in reported


def test_device_clock_set_anew_is_told():
    rig = Rig()
    source = rig.source()
    source.open()
    now = iter([100.1, 100.1, 200.1, 200.1])
    take(rig, source, lambda: next(now), Message(500.0, 100.0), Message(1.0, 200.0))
    (reported,) = source.events()
    assert "jumped" in reported
