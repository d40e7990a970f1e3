"""The world with physics that a run is in: who is there, and the rig among them."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import lru_cache
from importlib.util import find_spec
from math import radians
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from gazerig.config.load import ConfigError, ConfigFault, load, shipped
from gazerig.config.schema import Rig, load_rig, rig_path
from gazerig.drivers.errors import SetupError
from gazerig.drivers.extras import extra_hint
from gazerig.features.world.camera_params import WorldCameraParams
from gazerig.features.world.other_heads import HeadInState, OtherHeads
from gazerig.features.world.rig_in_world import RigInWorld
from gazerig.features.world.run.rig import rig_in_world
from gazerig.features.world.script import Fault, WorldScript
from gazerig.features.world.script_faults import CHECKS
from gazerig.features.world.shapes import shapes_of
from gazerig.features.world.shipped import HOME
from gazerig.features.world.world_scene import WorldScene
from gazerig.features.world.world_spec import WorldSpec
from gazerig.robot.app.bus_wiring import bus_names
from gazerig.robot.app.emulation import BOARDS, CHAINS
from gazerig.robot.app.options import RunOptions
from gazerig.robot.app.rig_description import mesh_faults
from gazerig.robot.app.run_scene import refuse_unruled
from gazerig.robot.description.world_shapes import WorldShapes
from gazerig.robot.model.clock import Clock
from gazerig.sim_mock.scenes.scene import Scene

if TYPE_CHECKING:
    from gazerig.features.world.physics import World
    from gazerig.sim_mock.pty.client import PtyBuses

MJCF = (".xml", ".mjcf")
"""Endings of the files that are MuJoCo's own worlds."""


class ServedRig(NamedTuple):
    """The terminals of one of the rigs of a world that another process computes.

    Attributes:
        buses: of that process, which its owner stops.
        paths: of this rig's terminals, by the names of its buses.
    """

    buses: "PtyBuses"
    paths: Mapping[str, str]


class RunWorld(NamedTuple):
    """The world of a run.

    Attributes:
        spec: what it is made of, for the processes that compute and render it.
        scene: the people in it, as a run and its score know them.
        camera: how large, how fast and how true the pictures of cameras are.
        number: which of its rigs is the run's.
        shared: the world itself where several runs of this process are in it, else None.
        served: the rig's terminals where several runs are in a world of another process, else None.
        others: the world's other rigs with all that can be seen of them.
    """

    spec: WorldSpec
    scene: Scene
    camera: WorldCameraParams
    number: int = 0
    shared: "World | None" = None
    served: ServedRig | None = None
    others: tuple[RigInWorld, ...] = ()

    def computed(self, clock: Clock) -> "World":
        """Return the world in this process."""
        if self.shared is not None:
            return self.shared
        model = self.spec.compiled()  # imports MuJoCo, whatever may render here
        from gazerig.features.world.physics import World

        return World(model, clock.now_s)

    def shapes(self) -> WorldShapes:
        """Return how the world looks, with the other heads where another process has it."""
        if self.served is None or self.number:
            return shapes_of(self.spec)
        buses = self.served.buses
        heads = map(HeadInState, self.others, buses.joints[1:])
        return shapes_of(self.spec, OtherHeads(buses.state, tuple(heads)))


def world_of(rig: Rig, options: RunOptions) -> RunWorld | None:
    """Return the world that was asked for, None without one.

    Raises:
        gazerig.config.load.ConfigError: its file is at fault, or there is none of that name.
        SetupError: MuJoCo is not installed, or the rig has no rule for what the world asks for.
    """
    if options.world is None:
        return None
    if find_spec("mujoco") is None:
        error = ModuleNotFoundError(name="mujoco")
        raise SetupError(f"--world {options.world}: {extra_hint('mujoco', 'world', error)}")
    for name in bus_names(rig):
        if (kind := rig.bus_named(name).kind) not in (*CHAINS, *BOARDS):
            raise SetupError(
                f"--world {options.world}: a bus of kind {kind} has no servos that a world could "
                "move: put its joints on one of our kinds, or use --scene"
            )
    scene, mjcf_file = world_scene(options.world, options.seed), mjcf_of(options.world)
    refuse_unruled(rig, scene, f"--world {options.world}")
    script = scene.figures.script
    # Where nothing is rendered, nobody sees the rigs: the page draws them by itself.
    looks = not options.no_pictures
    others = other_rigs(rig, script)
    rigs = (rig_in_world(rig, looks=looks), *standing(others, script, looks))
    spec = WorldSpec(None if mjcf_file else scene.figures, rigs, mjcf_file)
    return RunWorld(spec, scene, script.camera, others=standing(others, script, looks=True))


def other_rigs(rig: Rig, script: WorldScript) -> dict[str, Rig]:
    """Return the rigs of the other heads of a script, by the heads' names.

    Args:
        rig: of heads that name none.
        script: with the heads.

    Raises:
        gazerig.config.load.ConfigError: one of them is at fault.
    """
    return {
        name: load_rig(head.rig, further=[mesh_faults]) if head.rig else rig
        for name, head in script.heads.items()
    }


def standing(rigs: Mapping[str, Rig], script: WorldScript, looks: bool) -> tuple[RigInWorld, ...]:
    """Return the rigs of a script's other heads where they stand.

    Args:
        rigs: by the heads' names.
        script: with the heads.
        looks: with what can be seen of them.
    """
    return tuple(
        rig_in_world(
            rigs[name], f"{name}_", (head.x_m, head.y_m, 0.0), radians(head.facing_deg), looks
        )
        for name, head in script.heads.items()
    )


def world_scene(name_or_path: str, seed: int) -> WorldScene:
    """Return the people of a world; a user's own MJCF has none.

    Raises:
        gazerig.config.load.ConfigError: the file is at fault, or there is none of that name.
        SetupError: there is no such MJCF file.
    """
    name = Path(name_or_path).stem
    if mjcf_of(name_or_path) is not None:
        return WorldScene(name, WorldScript(people={}), seed)
    return WorldScene(name, world_script(name_or_path), seed)


def world_script(name_or_path: str) -> WorldScript:
    """Return the script of a world; its heads' rigs as seen from the working folder.

    Raises:
        gazerig.config.load.ConfigError: the file is at fault, or there is none of that name.
    """
    path = Path(name_or_path)
    if "/" not in name_or_path and path.suffix not in (".yaml", ".yml"):
        path = shipped("worlds", name_or_path, HOME)
    try:
        facts = path.stat()
    except OSError:
        return _read(path, None)  # says what is wrong
    return _read(path, (facts.st_ino, facts.st_mtime_ns, facts.st_size))


@lru_cache(maxsize=2)
def _read(path: Path, version: tuple[int, int, int] | None) -> WorldScript:
    """Return a script; a run asks for it several times, and reads it once."""

    def unknown_rigs(script: WorldScript) -> Iterator[Fault]:
        for name, head in script.heads.items():
            try:
                _rig_beside(path, head.rig)
            except ConfigError as error:
                yield f"heads.{name}.rig", error.faults[0].rule

    script = load(path, WorldScript, checks=(*CHECKS, unknown_rigs))
    heads = {
        name: replace(head, rig=_rig_beside(path, head.rig)) for name, head in script.heads.items()
    }
    return replace(script, heads=heads)


def _rig_beside(world: Path, rig: str) -> str:
    """Return a rig that a world's file names, a path as seen from the working folder.

    Raises:
        gazerig.config.load.ConfigError: there is no such rig.
    """
    if not rig:
        return rig
    found = rig_path(rig)
    if found != Path(rig):
        return rig  # by its name
    found = world.parent / found.expanduser()
    if not found.is_file():
        rule = f"{found}: there is no such file; correct the path, or give the name of a rig"
        raise ConfigError([ConfigFault(str(found), None, "", rig, rule)])
    return str(found)


def mjcf_of(name_or_path: str) -> Path | None:
    """Return the user's own MJCF file, None where the world is a script.

    Raises:
        SetupError: there is no such file.
    """
    path = Path(name_or_path)
    if path.suffix not in MJCF:
        return None
    if not path.is_file():
        raise SetupError(f"--world {path}: there is no such file")
    return path
