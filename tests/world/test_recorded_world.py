"""A recording names the world it was made in, and its replay shows that world."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("mujoco", reason="worlds need MuJoCo: pip install 'gazerig[world]'")

from gazerig.config.load import load, shipped_names, shipped_path
from gazerig.config.save_text import params_text
from gazerig.drivers.errors import SetupError
from gazerig.features.world.room import HOME
from gazerig.features.world.run.head_group import compose_group
from gazerig.features.world.run.recorded_world import recorded_shapes, recorded_world_info
from gazerig.features.world.shapes import ShapesInFrame, SpecShapes
from gazerig.features.world.world_scene import RigFrame
from gazerig.robot.app.options import RunOptions
from gazerig.robot.app.session import compose, run
from gazerig.robot.dashboard.feed.live_feed import (
    LiveFeed,
    LiveRig,
    RunState,
    rig_message,
    state_message,
)
from gazerig.robot.recording.read import RunRecording
from gazerig.robot.recording.run_info import WorldInfo, as_text, read_world_info
from gazerig.sim_mock.scenes.script import SceneScript

pytestmark = pytest.mark.usefixtures("branched_children")

ASKED = RunOptions(
    mock=True, fast=True, world="living-room", no_pictures=True, seconds=0.1, bus="ideal", seed=4
)


@pytest.fixture(scope="module")
def recorded(
    branched_children: None, tmp_path_factory: pytest.TempPathFactory
) -> tuple[RunRecording, SpecShapes]:
    """Return a recording of a run in a world, and how that looked."""
    file = tmp_path_factory.mktemp("recorded") / "run.mcap"
    composed = compose(replace(ASKED, record=file))
    run(composed, lambda: None, lambda line: None)
    assert composed.assembly.room is not None
    world = composed.assembly.room.shapes()
    assert isinstance(world, SpecShapes)
    return RunRecording(file), world


def test_a_recording_has_its_world_and_the_same_room_and_people_come_of_it(
    recorded: tuple[RunRecording, SpecShapes],
) -> None:
    recording, was = recorded
    info = recording.world
    assert info is not None
    assert (info.name, info.seed, info.start_s) == ("living-room", 4, 0.0)
    again = recorded_shapes(info, recording.info.placement)
    for t_s in (0.0, 5.0, 21.3):
        assert again.poses(t_s) == was.poses(t_s)
    before, after = was.parts(), again.parts()
    assert [part.name for part in after] == [part.name for part in before]


@pytest.mark.parametrize("name", shipped_names("worlds", HOME))
def test_a_script_is_the_same_after_a_recording(name: str, tmp_path: Path) -> None:
    script = load(shipped_path("worlds", name, HOME), SceneScript)
    file = tmp_path / "again.yaml"
    file.write_text(params_text(script), encoding="utf-8")
    assert load(file, SceneScript) == script


def test_another_head_has_the_people_of_the_first_as_from_where_it_stands(tmp_path: Path) -> None:
    file = tmp_path / "run.mcap"
    options = replace(ASKED, world="two-heads", record=file).check_and_complete()
    compose_group(options).run(lambda: None, lambda line: None)
    first, other = RunRecording(file), RunRecording(tmp_path / "run-other.mcap")
    assert first.world == other.world and other.world is not None and other.world.seed == 4
    shapes = recorded_shapes(other.world, other.info.placement)
    assert isinstance(shapes, ShapesInFrame)
    assert shapes.frame.p_m == pytest.approx((0.9, 0.0, 0.0))


def test_all_is_turned_and_moved_to_where_another_rig_stands(
    recorded: tuple[RunRecording, SpecShapes],
) -> None:
    _, world = recorded
    frame = RigFrame(((0.0, -1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)), (0.9, 0.2, 0.0))
    seen = ShapesInFrame(world, frame)
    poses, turned = world.poses(8.0), seen.poses(8.0)
    assert poses.keys() == turned.keys()
    for name, (_, p_m) in poses.items():
        assert turned[name][1] == pytest.approx(frame.point(p_m))
    for part, other in zip(world.parts(), seen.parts(), strict=True):
        here, there = points(part.shape), points(other.shape)
        assert len(here) == len(there)
        first = tuple(here[0].tolist())
        assert there[0] == pytest.approx(first if part.moves else frame.point(first))


def points(shape: Any) -> np.ndarray:
    return np.asarray(shape.vertices if hasattr(shape, "vertices") else shape.mesh.vertices)


def test_a_run_in_no_world_and_an_older_recording_have_none(tmp_path: Path) -> None:
    file = tmp_path / "run.mcap"
    options = RunOptions(mock=True, fast=True, scene="visitor", seconds=0.05, bus="ideal")
    run(compose(replace(options, record=file)), lambda: None, lambda line: None)
    assert RunRecording(file).world is None


def test_what_cannot_be_shown_is_said_in_one_line(tmp_path: Path) -> None:
    own = tmp_path / "mine.xml"
    own.write_text("<mujoco/>")
    info = recorded_world_info(replace(ASKED, world=str(own)), 0)
    assert info == WorldInfo("mine")
    with pytest.raises(SetupError, match="^the room is not shown: mine is in MuJoCo's own format"):
        recorded_shapes(info, ())
    with pytest.raises(SetupError, match=r"no longer valid \(old.yaml:1.*: room"):
        recorded_shapes(WorldInfo("old", "room: cellar\npeople: {}\n"), ())


@pytest.mark.parametrize(
    "changes", [{"seed": "-1"}, {"name": "7"}, {"start_s": "1e99"}, {"start_s": '"now"'}]
)
def test_nonsense_is_refused(changes: dict[str, str]) -> None:
    text = as_text(WorldInfo("hall", "room: hall\n", 3, 1.5))
    assert read_world_info(text) == WorldInfo("hall", "room: hall\n", 3, 1.5)
    with pytest.raises(ValueError, match="world"):
        read_world_info({**text, **changes})
    text.pop("seed")
    with pytest.raises(ValueError, match="without 'seed'"):
        read_world_info(text)


def test_the_page_shows_the_world_at_the_time_of_what_is_replayed(
    recorded: tuple[RunRecording, SpecShapes],
) -> None:
    _, world = recorded
    feed = LiveFeed()
    made = compose(ASKED).assembly
    feed.handle_message(rig_message(LiveRig(200.0, made.shown_rig(), world=world)))
    feed.handle_message(state_message(RunState({}, "", "", "", (None, None, 0), 2.0)))
    assert feed.world() is None
    feed.shown_s = 9.5  # of a snapshot
    now = feed.world()
    assert now is not None and now.world_s == 7.5
    made.close()
