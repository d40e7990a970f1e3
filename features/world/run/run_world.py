"""World with physics of a run: its people and its rig."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from importlib.util import find_spec
from math import radians
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from gazerig.config.load import find_file, load
from gazerig.config.rig import Rig
from gazerig.drivers.errors import SetupError, extra_hint
from gazerig.features.world.figure import Figures
from gazerig.features.world.rig_in_world import RigInWorld, ServoInWorld, Transmission
from gazerig.features.world.room import HOME
from gazerig.features.world.timeline import CHECKS
from gazerig.features.world.world_scene import WorldScene
from gazerig.features.world.world_spec import WorldSpec
from gazerig.robot.run.emulated import BOARDS, CHAINS, STOP_BEYOND_DEG, start_angles_rad
from gazerig.robot.run.options import RunOptions
from gazerig.robot.run.rig_limits import bus_names
from gazerig.robot.run.surroundings import refuse_missing_rules
from gazerig.sim_mock.scenes.script import SceneScript, WorldCameraParams

if TYPE_CHECKING:
    from gazerig.features.world.physics import World


def rig_in_world(
    rig: Rig,
    looks: bool = True,
) -> RigInWorld:
    """Return a rig for a world."""
    stops = {
        name: (radians(one.min_deg - STOP_BEYOND_DEG), radians(one.max_deg + STOP_BEYOND_DEG))
        for name, one in ((name, rig.joints[name]) for name in rig.names)
    }
    servos = tuple(_servo(rig, name) for name in rig.names)
    return RigInWorld(partial(_body, rig, looks), stops, start_angles_rad(rig), servos)


def _body(rig: Rig, looks: bool) -> tuple[str, Mapping[str, bytes]]:
    """Return the body of a rig as MJCF, and the files that the MJCF names."""
    # Meshes and the texture writer: 30 MB that a control loop does not need.
    from gazerig.robot.description.export import mjcf
    from gazerig.robot.run.rig_description import description_of

    xml, assets = mjcf(description_of(rig), looks=looks)
    return xml, assets


def _servo(rig: Rig, name: str) -> ServoInWorld:
    joint = rig.joints[name]
    joints: tuple[str, ...] = (name,)
    transmission = Transmission(joint.make_linkage())
    for pair in rig.couplings.values():
        if name in pair.joints:
            joints = pair.joints
            transmission = Transmission(joint.make_linkage(), pair.rates[joints.index(name)])
    return ServoInWorld(
        name, joint.bus, joint.id, joints, transmission, joint.model_facts.steps_per_turn
    )


COARSE_HZ = 15.0
"""Coarse pictures per second; without multisampling one of 320x240 takes 5 ms instead of 9."""
MJCF = (".xml", ".mjcf")
"""Suffixes of MuJoCo's own world files."""


class RunWorld(NamedTuple):
    """The world of a run."""

    spec: WorldSpec
    scene: WorldScene
    camera: WorldCameraParams

    def computed(self, now_s: Callable[[], float]) -> "World":
        """Return the world in this process."""
        # Imports MuJoCo, independent of the library that can render here
        model = self.spec.compile()
        from gazerig.features.world.physics import World

        return World(model, now_s)

    def served(self, folder: Path) -> "RunWorld":
        """Return the same world, which shares the people's motion with its server."""
        spec = self.spec.with_shared_file(folder)
        return self._replace(spec=spec, scene=WorldScene(self.scene.name, spec.figures))


def world_of(rig: Rig, options: RunOptions) -> RunWorld:
    """Return the requested world.

    Raises:
        gazerig.config.load.ConfigError: its file has a fault or does not exist.
        SetupError: MuJoCo is not installed, or the rig has no rule for an event of the world.
    """
    asked = str(options.world)
    if find_spec("mujoco") is None:
        error = ModuleNotFoundError(name="mujoco")
        raise SetupError(f"--world {asked}: {extra_hint('mujoco', 'world', error)}")
    for name in bus_names(rig):
        if (kind := rig.bus_named(name).kind) not in (*CHAINS, *BOARDS):
            raise SetupError(
                f"--world {asked}: a bus of kind {kind} has no servos that a world could "
                "move: put its joints on one of our kinds, or use --scene"
            )
    scene = world_scene(asked, options.seed)
    refuse_missing_rules(rig.gaze.top_down, scene, f"--world {asked}")
    # Without pictures the looks of the rig are not needed: the page has its own shapes.
    placed = rig_in_world(rig, looks=not options.no_pictures)
    spec = WorldSpec(scene.figures, placed, mjcf_of(asked))
    camera, level = scene.figures.script.camera, options.level
    if level is not None and level.pictures == "coarse":
        camera = replace(camera, rate_hz=min(COARSE_HZ, camera.rate_hz), samples=0)
    return RunWorld(spec, scene, camera)


def world_scene(name_or_path: str, seed: int) -> WorldScene:
    """Return the people of a world; a user's own MJCF has none.

    Raises:
        gazerig.config.load.ConfigError: the file has a fault or does not exist.
        SetupError: the MJCF file does not exist.
    """
    name = Path(name_or_path).stem
    if mjcf_of(name_or_path) is not None:
        return WorldScene(name, Figures(SceneScript(people={}), seed))
    path = find_file("worlds", name_or_path, HOME)
    script = load(path, SceneScript, checks=CHECKS)
    return WorldScene(name, Figures(script, seed))


def mjcf_of(name_or_path: str) -> Path | None:
    """Return the user's own MJCF file, None if the world is a script.

    Raises:
        SetupError: the file does not exist.
    """
    path = Path(name_or_path)
    if path.suffix not in MJCF:
        return None
    if not path.is_file():
        raise SetupError(f"--world {path}: there is no such file")
    return path
