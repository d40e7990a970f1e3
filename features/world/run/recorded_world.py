"""The world of a recorded run: its entry in the recording, and its shapes."""

from importlib.util import find_spec
from pathlib import Path

from gazerig.config.load import ConfigError, load
from gazerig.config.save_text import params_text
from gazerig.drivers.errors import SetupError, extra_hint
from gazerig.drivers.process.own_folder import OwnFolder
from gazerig.features.world.figure import Figures
from gazerig.features.world.run.run_world import mjcf_of, world_script
from gazerig.features.world.shapes import ShapesInFrame, script_shapes
from gazerig.features.world.timeline import CHECKS
from gazerig.features.world.world_scene import RigFrame
from gazerig.robot.analysis.mutual_gaze import HeadPlacement
from gazerig.robot.app.options import RunOptions
from gazerig.robot.description.world_shapes import WorldShapes
from gazerig.robot.recording.run_info import WorldInfo
from gazerig.sim_mock.scenes.script import SceneScript


def recorded_world_info(options: RunOptions, seed: int) -> WorldInfo | None:
    """Return the recording's entry for the world of a run, without its start time; None without.

    Raises:
        gazerig.config.load.ConfigError: the script has a fault.
    """
    if options.world is None or options.world_name is None:
        return None
    own = mjcf_of(options.world) is not None
    text = "" if own else params_text(world_script(options.world))
    return WorldInfo(options.world_name, text, seed)


def recorded_shapes(info: WorldInfo, placement: tuple[float, ...]) -> WorldShapes:
    """Return the shapes of the world of a recorded run, in the frame of its head's neck base.

    Raises:
        SetupError: the world cannot be shown; the message gives the reason.
    """
    if not info.script_yaml:
        raise SetupError(
            f"the room is not shown: {info.name} is in MuJoCo's own format, which is not recorded"
        )
    if find_spec("mujoco") is None:
        hint = extra_hint("mujoco", "world", ModuleNotFoundError(name="mujoco"))
        raise SetupError(f"the room is not shown: {hint}")
    shapes = script_shapes(Figures(_script(info), info.seed))
    return (
        ShapesInFrame(shapes, RigFrame(*HeadPlacement.from_numbers(placement)))
        if placement
        else shapes
    )


def _script(info: WorldInfo) -> SceneScript:
    with OwnFolder("replay") as folder:
        file = Path(folder) / f"{info.name}.yaml"
        file.write_text(info.script_yaml, encoding="utf-8")
        try:
            return load(file, SceneScript, checks=CHECKS)
        except ConfigError as error:
            first = str(error).splitlines()[0].replace(f"{folder}/", "")
            raise SetupError(
                f"the room is not shown: the recorded world is no longer valid ({first})"
            ) from None
