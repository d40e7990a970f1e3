"""The chosen camera, and messages without one; device calls are replaced."""

import threading

import numpy as np
import pytest
from oak_stand_in import Message, Rig, info, real, sdk
from present import present

from gazerig.drivers.camera.oak.discovery import UDEV_RULE, find_oak
from gazerig.drivers.camera.params import OakParams
from gazerig.drivers.errors import CameraError


def test_first_free_camera_is_taken(tmp_path):
    one, two = info("AA", "1.1"), info("BB", "1.2")
    assert find_oak(sdk([one, two]), usb=tmp_path) is one
    assert find_oak(sdk([one, two]), "BB", tmp_path) is two
    assert find_oak(sdk([one, two]), "1.2", tmp_path) is two


def test_no_camera_says_what_to_look_at(tmp_path):
    with pytest.raises(CameraError, match="no OAK camera found: plug it in with a USB 3 cable"):
        find_oak(sdk(), usb=tmp_path)


@pytest.mark.parametrize("listed_free", [True, False])
def test_camera_without_rights_gives_the_udev_rule(tmp_path, listed_free):
    forbidden = [info(status=real().XLinkError_t.X_LINK_INSUFFICIENT_PERMISSIONS)]
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
    with pytest.raises(CameraError, match="OAK camera AA is in use: close the program"):
        find_oak(sdk(connected=[info("AA")]), usb=tmp_path)


def test_usb_2_that_cannot_carry_it_says_what_it_can():
    assert Rig("HIGH").opened().events() == ()  # 640 x 400 at 30 Hz with depth: 26.9 MB/s
    source = Rig("HIGH").opened(rate_hz=60.0)
    (reported,) = source.events()
    assert "54 are requested" in reported and "USB 3 cable" in reported
    assert "set oak.rate_hz 33" in reported


@pytest.fixture
def rig():
    return Rig()


@pytest.mark.parametrize(("there", "missing"), [(slice(1), "CAM_B, CAM_C"), (slice(1, 3), "CAM_A")])
def test_e97_camera_without_stereo_or_colour_is_refused(rig, there, missing):
    rig.device.sockets = rig.device.sockets[there]
    with pytest.raises(CameraError, match=f"OAK-D has no camera at {missing}: use an OAK-D"):
        rig.source().open()
    assert rig.device.closed


def test_usb_3_is_no_matter():
    rig = Rig("SUPER")
    source = rig.opened()
    assert source.events() == ()
    assert rig.asked == OakParams()
    assert rig.device.reconnections == 0
    source.close()
    assert rig.device.closed == 1


@pytest.mark.parametrize(
    ("error", "cure"),
    [
        (
            "Failed to connect to device, error message: X_LINK_DEVICE_ALREADY_IN_USE",
            "close that program",
        ),
        (
            "Failed to find device after booting, error message: X_LINK_DEVICE_NOT_FOUND",
            "not a hub",
        ),
        ("Insufficient permissions (X_LINK_INSUFFICIENT_PERMISSIONS)", "udev rule"),
        ("Camera(0): no sensor mode for 4056x3040 at 60 fps", "oak.rate_hz to 30"),
        ("something else", "unplug it, wait a second"),
    ],
)
def test_error_at_the_start_comes_with_its_own_cure(error, cure):
    with pytest.raises(CameraError) as caught:
        Rig(start_fault=RuntimeError(error)).source().open()
    assert error in str(caught.value) and cure in str(caught.value)


def test_camera_that_does_not_start_is_freed_and_named():
    rig = Rig(start_fault=RuntimeError("X_LINK_DEVICE_ALREADY_IN_USE\nsomewhere"))
    with pytest.raises(CameraError, match="X_LINK_DEVICE_ALREADY_IN_USE somewhere.*another") as it:
        rig.source().open()
    assert "\n" not in str(it.value)
    assert rig.waited and rig.device.closed == 1  # type: ignore[attr-defined]


def test_unplugged_camera_is_lost(rig):
    source = rig.opened()
    rig.queue.fed.append(real().XLinkReadError("Couldn't read data from stream"))
    with pytest.raises(CameraError, match="was lost .Couldn't read data"):
        source.take(lambda: 0.0, threading.Event())


@pytest.mark.parametrize(
    ("stamp_s", "captured_s"), [(100.03, 100.03), (100.5, 100.08), (90.0, 100.08), (0.0, 100.08)]
)
def test_stamps_in_step_with_the_host_are_used_and_otherwise_arrivals(rig, stamp_s, captured_s):
    source = rig.opened()
    rig.queue.fed.append(Message(stamp_s))
    shot = present(source.take(lambda: 100.1, threading.Event()))
    assert shot.captured_s == pytest.approx(captured_s)
    assert source.events() == ()


def test_camera_without_frames_counts_as_lost(rig):
    source, now = rig.opened(), iter(np.arange(0.0, 9.0, 0.1))
    with pytest.raises(CameraError, match=r"no frame for 2 s"):
        source.take(lambda: next(now), threading.Event())
