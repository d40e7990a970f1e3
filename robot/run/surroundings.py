"""Surroundings of an emulated rig: a simulated scene, or the world with physics of ``--world``.

The world is a feature, found by the entry point ``world`` of the group ``gazerig.surroundings``.
"""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from gazerig.config.load import find_file, load
from gazerig.drivers.errors import SetupError
from gazerig.drivers.plugins import SURROUNDINGS, find
from gazerig.gaze.attention.top_down import TopDownParams
from gazerig.robot.run.options import RunOptions
from gazerig.sim_mock.scenes.faces_scene import FacesScene, faults
from gazerig.sim_mock.scenes.scene import Scene
from gazerig.sim_mock.scenes.script import SceneScript

if TYPE_CHECKING:
    import numpy as np

    from gazerig.config.rig import Rig
    from gazerig.drivers.types import Camera, FaceDetector
    from gazerig.robot.dashboard.feed.world_shapes import WorldShapes
    from gazerig.robot.model.clock import Clock
    from gazerig.robot.run.buses import RunBus
    from gazerig.robot.run.cameras import CameraView


def load_scene(name_or_path: str, seed: int = 0) -> FacesScene:
    """Return a simulated scene.

    Args:
        name_or_path: name of a shipped scene, or path of a script.
        seed: Seed of acts with a random time.

    Raises:
        gazerig.config.load.ConfigError: the name is unknown, or the file has faults.
    """
    script = load(find_file("scenes", name_or_path), SceneScript, checks=(faults,))
    return FacesScene(Path(name_or_path).stem, script, seed)


def scene_of(options: RunOptions) -> Scene | None:
    """Return the people and things around a rig, None if its camera has another source.

    Raises:
        gazerig.config.load.ConfigError: the script has faults.
        SetupError: the scene or world is unknown.
    """
    if options.world is not None:
        scene: Scene = world().scene(options)
        return scene
    return None if options.scene is None else load_scene(options.scene, options.seed)


def refuse_missing_rules(rules: TopDownParams, scene: Scene, option: str) -> None:
    """Reject a scene whose planner needs behaviours without rules.

    Raises:
        SetupError: the message names them.
    """
    missing = [behaviour for behaviour in scene.behaviours if behaviour not in rules.rules]
    if missing:
        raise SetupError(
            f"{option}: the rig has no rule for {', '.join(missing)}; "
            "add it under gaze.top_down.rules"
        )


def world() -> Any:
    """Return the ``WorldSurroundings`` of gazerig.features.world, which makes worlds.

    Raises:
        PluginError: it cannot be imported.
    """
    found: Any = find(SURROUNDINGS, "world").load()
    return found()


class RunRoom(Protocol):
    """A world from the view of its rig, whose emulated servos are in it."""

    @property
    def world(self) -> Any:
        """Return the world, for its people."""

    @property
    def clock(self) -> "Clock":
        """Return the clock of the run."""

    @property
    def run_bus(self) -> "RunBus":
        """Return the bus of the rig's emulated servos."""

    @property
    def scene(self) -> Scene:
        """Return the people in the world, in the frame of the rig."""

    def camera(
        self,
        rig: "Rig",
        options: RunOptions,
        view: "CameraView",
        rng: "np.random.Generator",
        detector: "Callable[[], FaceDetector]",
    ) -> "Camera":
        """Return the rig's camera; called only once."""

    def start_s(self) -> float | None:
        """Return the start time of the script of the people, None before it."""

    def shapes(self) -> "WorldShapes":
        """Return the shapes of the world."""
