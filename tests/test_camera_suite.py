"""Promises of every camera to the loop, on ours: the suite that packages run on theirs."""

import time
from typing import Any

import cv2
import numpy as np
import pytest

from gazerig.config.schema import load_rig
from gazerig.drivers.camera.webcam import Webcam
from gazerig.robot.app.assemble import assemble
from gazerig.robot.app.options import RunOptions
from gazerig.testing import CameraBench, CameraSuite
from gazerig.testing.camera_suite import of_source


class Video4Linux:
    """A capture device that can be pulled out."""

    def __init__(self, file):
        self.file, self.grabs = file, 0
        self.restore()

    def lose(self):
        self.file.unlink()

    def restore(self):
        self.file.touch()

    def isOpened(self):  # noqa: N802
        return self.file.exists()

    def grab(self):
        time.sleep(0.001)
        self.grabs += 1
        return self.file.exists()

    def retrieve(self):
        return True, np.full((4, 6, 3), self.grabs % 256, np.uint8)

    def get(self, what):
        return 30.0 if what == cv2.CAP_PROP_FPS else 0.0

    def set(self, what, value):
        return True

    def release(self):
        pass


class TestWebcam(CameraSuite):
    @pytest.fixture
    def bench(self, tmp_path):
        device: Any = Video4Linux(tmp_path / "video0")
        return of_source(
            lambda: Webcam(device.file, capture=lambda name: device),
            device.lose, device.restore,
        )  # fmt: skip


@pytest.mark.parametrize("pixels", [False, True], ids=["ideal", "drawn"])
class TestScene(CameraSuite):
    @pytest.fixture
    def bench(self, pixels):
        made = assemble(
            load_rig("desk"), RunOptions(mock=True, fast=True, scene="visitor", pixels=pixels)
        )
        clock = made.clock

        def wait():
            clock.sleep_until(clock.now_s() + 0.01)
            made.poses.remember(clock.now_s(), (0.0, 0.0, 0.0))

        wait()
        yield CameraBench(lambda: made.robot.camera, clock.now_s, wait)
        made.close()
