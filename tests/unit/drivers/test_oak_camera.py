"""The OAK source over depthai's own host-only pipeline: the code and messages of the device."""

import os
import subprocess
import sys
import threading
import time
from functools import partial
from types import SimpleNamespace
from typing import Any
from unittest.mock import MagicMock

import numpy as np
import pytest
from fakes.films import write_film
from present import present

from gazerig.drivers.camera.oak.discovery import load_depthai
from gazerig.drivers.camera.oak.pipeline import (
    PipelineOutputs,
    device_nodes,
)
from gazerig.drivers.camera.oak.source import OakSource
from gazerig.drivers.camera.params import OakParams
from gazerig.drivers.errors import CameraError, install_command

GO_ON = threading.Event()
PARAMS = OakParams(rate_hz=60.0)
LENGTH = 30


@pytest.fixture(scope="module")
def dai():
    return load_depthai()


@pytest.fixture(scope="module")
def film(tmp_path_factory):
    path = tmp_path_factory.mktemp("oak") / "film.mp4"
    return write_film(path, LENGTH, size=(320, 240), grey=8, fourcc="mp4v")


def stamped(message, frame):
    """Set the times and the number of a message's frame."""
    message.setTimestamp(frame.getTimestamp())
    message.setTimestampDevice(frame.getTimestampDevice())
    message.setSequenceNum(frame.getSequenceNum())
    return message


def depth_mm(dai, frame):
    """Return a depth message for a frame: nothing on the left, its number on the right."""
    mm = np.zeros((120, 160), np.uint16)  # half the size, as a camera may give it
    mm[:, 80:] = 1000 + frame.getSequenceNum()
    found = dai.ImgFrame()
    found.setType(dai.ImgFrame.Type.RAW16)
    found.setWidth(160)
    found.setHeight(120)
    found.setData(mm.view(np.uint8).ravel())
    return stamped(found, frame)


def answering(dai, pipeline, make, source) -> Any:
    """Return the output of a node that sends what ``make`` makes of every frame."""

    class Answer(dai.node.ThreadedHostNode):
        def __init__(self) -> None:
            super().__init__()
            self.input = self.createInput()
            self.out = self.createOutput()

        def run(self) -> None:
            while self.isRunning():
                self.out.send(make(self.input.get()))

    node = pipeline.create(Answer)
    source.link(node.input)
    return node.out


def host_nodes(film, loop=True):
    """Make a substitute for device_nodes: a replayed film and a node that answers each picture."""

    def nodes(dai, pipeline, params) -> PipelineOutputs:
        replay = pipeline.create(dai.node.ReplayVideo)
        replay.setReplayVideoFile(film)
        replay.setOutFrameType(dai.ImgFrame.Type.NV12)
        replay.setFps(params.rate_hz)
        replay.setLoop(loop)
        depth = answering(dai, pipeline, partial(depth_mm, dai), replay.out)
        return PipelineOutputs(replay.out, depth)

    return nodes


def opened(nodes) -> OakSource:
    source = OakSource(PARAMS, nodes, on_device=False)
    source.open()
    return source


def test_colour_depth_and_times_of_one_instant(film):
    source = opened(host_nodes(film))
    shots: Any = [source.take(time.monotonic, GO_ON) for _ in range(12)]
    source.close()
    assert [shot.number for shot in shots] == list(range(1, 13))
    for shot in shots:
        assert shot.image.shape == (240, 320, 3)
        assert not shot.image.flags.writeable
        assert shot.depth_m.shape == (240, 320) and shot.depth_m.dtype == np.float32
        assert np.isnan(shot.depth_m[:, :160]).all()
        # Depth and picture are of the same instant: both carry the film's number.
        number = round(float(shot.depth_m[0, 319]) * 1000.0) - 1000
        shade = round(float(shot.image.mean()) / 8.0)
        assert abs(shade - number % LENGTH) <= 1
        assert shot.lens is None


def test_stream_that_ends_is_a_lost_camera(film):
    source = opened(host_nodes(film, loop=False))
    with pytest.raises(CameraError, match="OAK camera was lost .*: check its cable"):
        for _ in range(2 * LENGTH):
            source.take(time.monotonic, GO_ON)
    source.close()
    source.open()
    assert present(source.take(time.monotonic, GO_ON)).number == 1
    source.close()


def test_depthai_is_loaded_without_telemetry_and_without_a_word():
    code = (
        "import sys, gazerig.drivers.camera.oak.source\n"
        "assert 'depthai' not in sys.modules\n"
        "from gazerig.drivers.camera.oak.discovery import load_depthai; load_depthai()\n"
        "import os; assert os.environ['DEPTHAI_TELEMETRY'] == '0'"
    )
    environment = {k: v for k, v in os.environ.items() if not k.startswith("DEPTHAI")}
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, env=environment, check=False
    )
    assert (done.returncode, done.stdout) == (0, ""), done.stderr


def test_depthai_that_is_not_there_is_named_with_its_extra(monkeypatch):
    monkeypatch.setitem(sys.modules, "depthai", None)
    with pytest.raises(CameraError) as told:
        load_depthai()
    assert str(told.value) == f"depthai is not installed: {install_command('oak')}"


# Requested nodes of a camera and their settings; the nodes themselves are substitutes


class Pipeline:
    """Makes a substitute for each node, and keeps them by name."""

    def __init__(self, dai, platform="RVC4") -> None:
        self.made: dict[str, list[MagicMock]] = {}
        device = SimpleNamespace(getPlatform=lambda: getattr(dai.Platform, platform))
        self.getDefaultDevice = lambda: device

    def create(self, node):
        made = MagicMock()
        made.build.return_value = made
        self.made.setdefault(node.__name__, []).append(made)
        return made


def asked(dai, platform="RVC4", **wanted):
    """Return the outputs and the nodes made for them."""
    pipeline = Pipeline(dai, platform)
    return device_nodes(dai, pipeline, OakParams(**wanted)), pipeline.made


def test_colour_is_straightened(dai):
    _, made = asked(dai, rate_hz=20.0)
    request = made["Camera"][0].requestOutput
    assert request.call_args.args == ((640, 400),)
    assert request.call_args.kwargs["enableUndistortion"] is True
    assert request.call_args.kwargs["fps"] == 20.0


@pytest.mark.parametrize("platform", ["RVC2", "RVC4"])
def test_depth_lies_on_the_colour_frame(dai, platform):
    outputs, made = asked(dai, platform)
    assert len(made["Camera"]) == 3
    (stereo,) = made["StereoDepth"]
    if platform == "RVC4":
        assert outputs.depth is made["ImageAlign"][0].outputAligned
    else:
        assert outputs.depth is stereo.depth and "ImageAlign" not in made
