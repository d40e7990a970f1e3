"""A browser's own camera in the place of an emulated rig's, while its pictures come."""

import threading
import time
from collections.abc import Iterator
from math import radians
from typing import Any, cast

import cv2
import numpy as np
import pytest
from browser import browsing
from page_at_the_door import PATIENCE_S, TOKEN, Rig, opened
from page_feed import info, visit
from present import present
from shown_page import wait_for
from websockets.exceptions import ConnectionClosed

from gazerig.config.schema import load_rig
from gazerig.drivers.camera.browser_source import FIELD_DEG, LATENCY_S, BrowserSource
from gazerig.drivers.camera.shared_slots import MOST_BYTES, JpegSlot
from gazerig.drivers.camera.worker import CameraWorker
from gazerig.drivers.types import Detections
from gazerig.robot.dashboard.door.page_door import HeadNews
from gazerig.robot.model.frames import CameraMount, fixed_mount
from gazerig.robot.run.cameras import SILENT_S, BrowserCamera
from gazerig.robot.run.options import RunOptions
from gazerig.robot.run.run import Run


def jpeg(grey: int = 90, size: tuple[int, int] = (48, 64)) -> bytes:
    done, data = cv2.imencode(".jpg", np.full((*size, 3), grey, np.uint8))
    assert done
    return data.tobytes()


# The pictures' way


def test_the_newest_picture_is_read_and_none_twice():
    slot = JpegSlot()
    assert slot.newer(0) is None and slot.came_s == float("-inf")
    assert slot.put(b"one", 1.0) and slot.put(b"another", 2.0)
    assert slot.newer(0) == (2, 2.0, b"another") and slot.newer(2) is None
    assert not slot.put(b"x" * (MOST_BYTES + 1), 3.0) and not slot.put(b"", 3.0)
    assert slot.came_s == 2.0


def test_pictures_become_frames_of_a_lens_that_is_taken_to_be_usual():
    slot, stop = JpegSlot(), threading.Event()
    source = BrowserSource(slot)
    source.open()
    slot.put(jpeg(), 10.0)
    shot = source.take(lambda: 10.1, stop)
    assert shot is not None and shot.image.shape == (48, 64, 3) and shot.lens is not None
    assert shot.captured_s == 10.0 - LATENCY_S and not shot.image.flags.writeable
    assert 2.0 * np.arctan(32.0 / shot.lens.fx_px) == pytest.approx(radians(FIELD_DEG), abs=0.02)


def test_what_is_no_picture_is_left_out_and_told_once():
    slot, stop = JpegSlot(), threading.Event()
    source = BrowserSource(slot)
    for k in range(3):
        slot.put(b"\xff\xd8\xff and no more", float(k))
        threading.Timer(0.05, stop.set).start()
        assert source.take(lambda: 0.0, stop) is None
        stop.clear()
    assert len(source.events()) == 1 and source.events() == ()


# Who is looked through


class Browser:
    """A camera that finds what it is given, in the place of one with a process."""

    found: Detections | None = None
    closed = False

    def open(self) -> None: ...

    def latest(self, now_s: float) -> Detections | None:
        return self.found

    def close(self) -> None:
        self.closed = True


def test_the_browser_stands_in_from_its_first_frame_until_it_is_silent():
    now_s, browser, used, lines = [100.0], Browser(), list[Any](), list[str]()

    def make(pictures: JpegSlot) -> CameraWorker:
        return cast(CameraWorker, browser)

    camera = BrowserCamera(make, lambda: now_s[0], used.append, lines.append)

    def picture() -> None:
        camera.take(jpeg())
        if (starting := camera._starting) is not None:
            starting.join()
        camera.update()

    camera.update()
    picture()
    assert not camera.in_use and used == []  # the networks are being loaded
    browser.found = Detections(99.9, 7, 64, 48)
    camera.update()
    camera.update()
    assert camera.in_use and used == [browser]
    assert "field of view is assumed to be 60 deg" in lines[0]
    now_s[0] += SILENT_S + 0.1
    camera.update()
    assert not camera.in_use and used == [browser, None]
    assert lines[1:] == ["the browser's camera has ended: the scene continues"]
    picture()
    assert used == [browser, None]  # its newest detections are those before the pause
    browser.found = Detections(now_s[0], 8, 64, 48)
    camera.update()
    assert used == [browser, None, browser] and not browser.closed
    camera.close()
    assert browser.closed


def test_an_emulated_rig_can_be_lent_a_camera_that_stands_still():
    rig = load_rig("desk")
    made = Run(rig, RunOptions(mock=True, scene="visitor", bus="ideal"))
    try:
        browser, own, other = present(made.browser), made.robot.camera, cast(Any, Browser())
        assert made.view.mount.on_head
        browser._switch(other, "begins")
        assert made.robot.camera is other and not made.view.mount.on_head
        still = CameraMount(fixed_mount(rig.camera, made.shown_rig().kinematics))
        level = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
        assert made.view.mount.pose(level, (0.0, 0.0, 9.0)) == still.pose(level, (0.0, 0.0, 0.0))
        browser._switch(None, "ends")
        assert made.robot.camera is own and made.view.mount.on_head
    finally:
        made.close()


# The door


def taker(near: Rig) -> list[bytes]:
    """Take all pictures that come in."""
    taken: list[bytes] = []

    def take(data: bytes) -> bool:
        taken.append(data)
        return True

    near.take_picture = take
    return taken


@pytest.fixture(scope="module")
def near() -> Iterator[Rig]:
    with opened("127.0.0.1") as rig:
        yield rig


def test_pictures_come_in_one_at_a_time(near):
    taken = taker(near)
    picture = jpeg()
    with near.knock("/api/v1/webcam") as line:
        for _ in range(3):
            line.send(picture)
            assert line.recv(timeout=PATIENCE_S) == "next"
        assert taken == [picture] * 3
        line.send(b"<svg>")
        assert "only JPEG" in str(line.recv(timeout=PATIENCE_S))
        with pytest.raises(ConnectionClosed):
            line.recv(timeout=PATIENCE_S)
    assert len(taken) == 3


def test_a_flood_of_pictures_is_thinned(near):
    taken = taker(near)
    with near.knock("/api/v1/webcam") as line:
        for _ in range(60):
            line.send(jpeg(size=(8, 8)))
            assert line.recv(timeout=PATIENCE_S) == "next"
    assert 0 < len(taken) < 60


def test_the_newest_browser_takes_over(near):
    near.take_picture = lambda data: True
    with near.knock("/api/v1/webcam") as first, near.knock("/api/v1/webcam") as second:
        second.send(jpeg())
        assert second.recv(timeout=PATIENCE_S) == "next"
        first.send(jpeg())
        assert "taken over" in str(first.recv(timeout=PATIENCE_S))


CAMERA = """
const drawn = document.createElement('canvas'); drawn.width = 640; drawn.height = 480;
const brush = drawn.getContext('2d'); let step = 0;
setInterval(() => { brush.fillStyle = `rgb(${step++ % 255},99,99)`; brush.fillRect(0, 0, 640, 480) }, 40);
navigator.mediaDevices.getUserMedia = async () => drawn.captureStream(25);
"""
REFUSED = """
navigator.mediaDevices.getUserMedia = async () => { throw new DOMException('no', 'NotAllowedError') };
"""


def test_the_button_sends_the_browsers_own_pictures_until_it_is_pressed_again(near):
    taken = taker(near)
    with browsing(drawing="0") as tab:

        def of_button(attribute: str) -> str:
            script = f"String(document.querySelector('#webcam')?.{attribute})"
            return str(tab.ask("Runtime.evaluate", expression=script)["result"]["value"])

        def pressed(on: str) -> bool:
            return of_button("getAttribute('aria-pressed')") == on

        press = "document.querySelector('#webcam').click();"
        near.door.call_soon(near.door.distribute, HeadNews(topics=(info(visit("desk")[0]),)))
        tab.go(f"{near.url}/?token={TOKEN}")
        wait_for(lambda: of_button("hidden") == "false", "the button")
        tab.run(REFUSED + press)
        wait_for(lambda: "not allowed to use its camera" in tab.words(), "the refusal")
        tab.run(CAMERA + press)
        wait_for(lambda: len(taken) > 3, "pictures")
        found = cv2.imdecode(np.frombuffer(taken[-1], np.uint8), cv2.IMREAD_COLOR)
        assert found is not None and found.shape == (480, 640, 3)
        assert pressed("true")
        tab.run(press)
        wait_for(lambda: pressed("false"), "the end")
        time.sleep(0.5)
        count = len(taken)
        time.sleep(0.5)
        assert len(taken) == count


def test_without_the_token_no_picture_comes_in(near):
    with pytest.raises(Exception, match="403"):
        near.knock("/api/v1/webcam", Cookie=None)
