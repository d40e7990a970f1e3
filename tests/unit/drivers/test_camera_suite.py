"""Promises of every camera to the loop, on ours: the suite that packages run on theirs."""

import time
from typing import Any

import pytest
from stand_in import Capture

from gazerig.config.schema import load_rig
from gazerig.drivers.camera.webcam import Webcam
from gazerig.robot.run.options import RunOptions
from gazerig.robot.run.run import Run
from gazerig.testing import CameraBench, CameraSuite
from gazerig.testing.camera_suite import of_source


class Video4Linux(Capture):
    """A capture device that can be pulled out."""

    def __init__(self, file):
        super().__init__()
        self.file, self.lose = file, file.unlink
        self.stated_hz = 30.0
        file.touch()

    def isOpened(self):  # noqa: N802
        return self.file.exists()

    def grab(self):
        time.sleep(0.001)
        return super().grab() and self.file.exists()


class TestWebcam(CameraSuite):
    @pytest.fixture
    def bench(self, tmp_path):
        device: Any = Video4Linux(tmp_path / "video0")
        return of_source(lambda: Webcam(device.file, capture=lambda name: device), device.lose)


@pytest.mark.parametrize("pixels", [False, True])
class TestScene(CameraSuite):
    @pytest.fixture
    def bench(self, pixels):
        made = Run(
            load_rig("desk"), RunOptions(mock=True, fast=True, scene="visitor", pixels=pixels)
        )
        clock = made.clock

        def wait():
            clock.sleep_until(clock.now_s() + 0.01)
            made.view.poses.remember(clock.now_s(), (0.0, 0.0, 0.0))

        wait()
        yield CameraBench(lambda: made.robot.camera, clock.now_s, wait)
        made.close()
