"""The world of the emulator's process, and the camera that looks into it from another one."""

from pathlib import Path

import numpy as np
import pytest

from gazerig.config.schema import load_rig
from gazerig.drivers.camera.worker import CameraWorker
from gazerig.drivers.errors import SetupError
from gazerig.features.world.gl_context import NoRenderer
from gazerig.features.world.run.poses import RigInState, WorldPoses
from gazerig.features.world.run.run_world import RunWorld, world_of
from gazerig.features.world.run.sight import WorldCamera
from gazerig.robot.app.gaze_models import rig_kinematics
from gazerig.robot.app.options import RunOptions
from gazerig.robot.app.run_bus import emulated_lines
from gazerig.robot.model.frames import CameraMount
from gazerig.sim_mock.cameras.detections import SceneCamera
from gazerig.sim_mock.cameras.frame_times import FrameParams
from gazerig.sim_mock.pty.line import BusSettings

pytestmark = pytest.mark.usefixtures("mujoco")


class Host:
    """A clock that is set, and a world on it."""

    def __init__(self, folder: Path) -> None:
        from gazerig.features.world.served_world import ServedWorld

        self.rig = load_rig("minimal")
        world = world_of(self.rig, RunOptions(mock=True, world="living-room"))
        assert world is not None
        self.world: RunWorld = world
        self.t_s = 100.0
        self.served = ServedWorld(world.spec, folder / "state", lambda: self.t_s)
        for name, line in emulated_lines(self.rig).items():
            self.served.device(BusSettings(line, name))
        joints = RigInState(rig_kinematics(self.rig), self.served.joints())
        self.poses = WorldPoses(folder / "state", joints)

    def serve(self, seconds: float, heard: bool) -> None:
        end_s = self.t_s + seconds
        while self.t_s < end_s - 1e-9:
            self.t_s += 0.001
            self.served.serve(heard)


@pytest.fixture
def host(tmp_path: Path) -> Host:
    return Host(tmp_path)


def test_people_wait_until_a_client_has_spoken(host: Host) -> None:
    from gazerig.features.world.served_world import PUBLISH_MS

    host.serve(0.05, heard=False)
    assert host.poses.newest() is None and host.poses.begin_s is None
    host.serve(0.05, heard=True)
    begin_s, newest = host.poses.begin_s, host.poses.newest()
    assert begin_s is not None and newest is not None
    assert begin_s == pytest.approx(100.051, abs=0.002)
    assert 0.0 <= host.t_s - newest.t_s <= PUBLISH_MS / 1e3 + 1e-9
    state = host.poses.state
    assert state is not None and state.t_s == pytest.approx(newest.t_s - begin_s, abs=0.002)


def test_the_state_is_that_of_physics(host: Host) -> None:
    host.serve(0.02, heard=True)
    assert host.poses.newest() is not None and host.poses.state is not None
    truly = host.served.world.joints_rad()
    for name, at in host.served.joints().items():
        assert host.poses.state.qpos[at] == pytest.approx(truly[name], abs=1e-3)


class Broken(CameraWorker):
    """A camera's process in which nothing can render."""

    def __init__(self, error: SetupError) -> None:
        self.error = error

    def open(self) -> None:
        raise self.error

    def close(self) -> None:
        pass

    def events(self) -> tuple[str, ...]:
        return ()


def camera(host: Host, error: SetupError | None) -> WorldCamera:
    def ideal(begin_s: float) -> SceneCamera:
        return SceneCamera(
            FrameParams(), host.world.scene, CameraMount(host.rig.camera),
            host.poses.head, np.random.default_rng(1), begins_s=begin_s,
        )  # fmt: skip

    return WorldCamera(None if error is None else Broken(error), ideal, host.poses)


@pytest.mark.parametrize("error", [None, NoRenderer("egl: it is missing")])
def test_without_pictures_detections_are_those_of_the_same_people(
    host: Host, error: SetupError | None
) -> None:
    seen = camera(host, error)
    seen.open()
    assert (("egl: it is missing" in " ".join(seen.events())) is True) == (error is not None)
    assert seen.latest(host.t_s) is None  # the script has not begun
    host.serve(0.02, heard=True)
    found = seen.latest(host.t_s + 0.2)
    assert seen.start_s == host.poses.begin_s
    assert found is None or found.image is None
    seen.close()
