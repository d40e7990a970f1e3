"""The simulated surroundings of a run: a scene, where one was asked for."""

from dataclasses import replace

from gazerig.config.rig import Rig
from gazerig.drivers.errors import SetupError
from gazerig.robot.app.options import RunOptions
from gazerig.robot.app.surroundings import surroundings
from gazerig.sim_mock.scenes.registry import scenes
from gazerig.sim_mock.scenes.scene import Scene


def scene_of(rig: Rig, options: RunOptions) -> Scene | None:
    """Return the scene that was asked for, None where a camera looks at something else.

    Raises:
        SetupError: there is no such scene, or the rig has no rule for something that its action
            planner would have to choose there.
    """
    if options.scene is None:
        return None
    known = scenes()
    if options.scene not in known:
        raise SetupError(f"--scene {options.scene}: unknown; scenes: {', '.join(sorted(known))}")
    scene = known[options.scene]
    refuse_unruled(rig, scene, f"--scene {options.scene}")
    return scene


def refuse_unruled(rig: Rig, scene: Scene, option: str) -> None:
    """Refuse a scene that needs a planner of behaviours that the rig has no rules for.

    Raises:
        SetupError: names them.
    """
    missing = [b for b in scene.behaviours if b not in rig.gaze.top_down.rules]
    if missing:
        raise SetupError(
            f"{option}: the rig has no rule for {', '.join(missing)}; "
            "add it under gaze.top_down.rules"
        )


def for_surroundings(rig: Rig, options: RunOptions) -> Rig:
    """Return the rig with what a boxing match needs, where its surroundings are one.

    Its action planner is switched on, and in a world the finder of red gloves. Rules that lack a
    behaviour stay as they are: ``scene_of`` refuses the scene.
    """
    scene: Scene | None = scenes().get(options.scene or "")
    if options.world is not None:
        scene = surroundings(options.world).scene(options)
    rules = rig.gaze.top_down
    if scene is None or not scene.behaviours or not {*scene.behaviours} <= rules.rules.keys():
        return rig
    planning = replace(rules, planner=replace(rules.planner, enabled=True))
    rig = replace(rig, gaze=replace(rig.gaze, top_down=planning))
    return rig if options.world is None else replace(rig, motion=replace(rig.motion, gloves=True))
