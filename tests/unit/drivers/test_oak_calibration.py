"""The lens of an OAK camera: gazerig calibrate camera --oak."""

from pathlib import Path

import pytest
from command_line import invoked
from oak_stand_in import Group, Message, Rig

from gazerig.config.schema import load_rig
from gazerig.drivers.camera.oak.source import OakSource


@pytest.fixture
def rig_file(tmp_path) -> Path:
    pytest.importorskip("gazerig.features.bringup")
    path = tmp_path / "rig.yaml"
    text = (Path(__file__).parents[3] / "config/rigs/desk.yaml").read_text(encoding="utf-8")
    path.write_text(text, encoding="utf-8")
    return path


class Looping(Rig):
    """A camera that gives the same frame again and again."""

    def __init__(self, lens) -> None:
        super().__init__()
        frame = Group(colour=Message(0.0, lens, (640, 400)))
        self.queue.get = lambda timeout: frame  # type: ignore[method-assign]


def test_camera_that_is_there_goes_into_the_rig_with_its_frames_own_lens(rig_file, monkeypatch):
    command = pytest.importorskip("gazerig.features.bringup.cli.calibrate.camera")
    seen = [[560.0, 0.0, 321.0], [0.0, 561.0, 198.0], [0.0, 0.0, 1.0]]
    camera = Looping(seen)
    monkeypatch.setattr(command, "OakSource", stood_in(camera))
    done = invoked("calibrate", "camera", str(rig_file), "--oak", "--what", "lens", "--yes")
    assert done.code == 0, done.err
    assert "the camera's own lens: focal length 560.0, 561.0 px" in done.err
    lens = load_rig(str(rig_file)).camera.lens
    assert lens is not None and (lens.focal_px[0], lens.centre_px[1]) == (560.0, 198.0)
    assert camera.device.closed


def stood_in(camera):
    """Return a class of sources that look through a camera that is stood in for."""

    class Source(OakSource):
        def __init__(self, params) -> None:
            whole = camera.source()
            super().__init__(params, whole._nodes, True, lambda: camera.dai)

    return Source


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (("--oak", "--camera", "1"), "--oak and --camera name two cameras"),
        (("--oak", "--mock"), "simulates a webcam: leave --oak away"),
    ],
)
def test_what_cannot_be_is_said(rig_file, words, says):
    before = rig_file.read_bytes()
    done = invoked("calibrate", "camera", str(rig_file), *words)
    assert done.code == 2 and says in done.err, done.err
    assert rig_file.read_bytes() == before
