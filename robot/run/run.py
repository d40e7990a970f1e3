"""One run of a rig, put together from top to bottom: rig, bus, camera, models, robot.

``session.py`` has the other half: how a run begins, who watches it, and how it ends.
"""

from collections.abc import Callable
from contextlib import ExitStack
from functools import cached_property, partial
from typing import TYPE_CHECKING

from gazerig.config.faults import ConfigError
from gazerig.config.parameters import apply_changes, start_note
from gazerig.config.rig import Rig
from gazerig.config.save import RigLayers
from gazerig.config.shipped_files import shipped_names
from gazerig.config.tracks import TrackFiles
from gazerig.drivers.camera.source import FrameSource
from gazerig.drivers.types import Camera, FaceDetector
from gazerig.gaze.scanpath.scanpath import row_sums_note
from gazerig.robot.dashboard.feed.rig_feed import ShownRig
from gazerig.robot.loop.body import Body
from gazerig.robot.loop.chooser import Chooser, RuleChooser, TargetChooser
from gazerig.robot.loop.commands import CommandExecutor
from gazerig.robot.loop.loop import Robot
from gazerig.robot.loop.tracks import TrackChoices
from gazerig.robot.model.clock import Clock, LoopParams, RealClock, SimulatedClock
from gazerig.robot.model.commands import Tune
from gazerig.robot.model.frames import CameraParams, fixed_mount
from gazerig.robot.model.types import JointAngles
from gazerig.robot.perception.perception import Perception, PixelToWorld
from gazerig.robot.run.buses import RunBus, run_bus
from gazerig.robot.run.cameras import (
    BrowserCamera,
    HeadPose,
    browser_worker,
    detector_of,
    place_camera,
    real_camera,
    scene_camera,
    true_head_pose,
)
from gazerig.robot.run.live import ParamStore, rig_folder, rig_in_effect
from gazerig.robot.run.models import GazeModels, random_generators, rig_kinematics, with_rule
from gazerig.robot.run.options import RunOptions
from gazerig.robot.run.rig_description import (
    description_of,
    sag_compensation,
    shape_of,
)
from gazerig.robot.run.rig_limits import (
    face_parts_m,
    limits,
    park_rad,
    track_fit,
)
from gazerig.robot.run.run_rig import run_info, with_options
from gazerig.robot.run.surroundings import RunRoom, refuse_missing_rules, scene_of, world
from gazerig.robot.run.voice import RunVoice
from gazerig.robot.safety.guard import Guard

if TYPE_CHECKING:
    from gazerig.robot.recording.recorder import Recorder


class Run:
    """The robot of a rig for one run, and the parts around it; nothing moves, no device is open.

    Args:
        rig: The configuration.
        options: Options of the run.
        camera: Camera of a program, instead of the rig's.
        detector: Face detector of a program.
        rule: Rule of a program for the target, before the rig's attention.
        chooser: Chooser of the target instead of the rig's attention.
        wrap_body: Wraps the body, for a recording or a rerun.

    Attributes:
        rig: The rig in effect: with the options and the changes of parameters.
        notes: Messages for the user.
        room: The world of --world, None without.
        browser: A browser's camera that may replace the emulated rig's, None for other rigs.
        recorder: Records the run, None without --record.
        voice: Says sounds and texts.

    Raises:
        gazerig.config.load.ConfigError: the walk that the rig names is invalid.
        SetupError: a film or model file cannot be used.
    """

    def __init__(
        self,
        rig: Rig,
        options: RunOptions,
        *,
        camera: Camera | FrameSource | None = None,
        detector: FaceDetector | None = None,
        rule: Chooser | None = None,
        chooser: TargetChooser | None = None,
        wrap_body: Callable[[Body], Body] | None = None,
    ) -> None:
        # Rig, models and camera
        self.options = options
        self.rig = rig = with_options(rig, options)
        random = random_generators(options.seed)
        self.models = models = GazeModels(rig, random)
        drawn = options.pixels or (options.world is not None and not options.no_pictures)
        in_process = options.scene is None and options.world is None
        self.view, notes = place_camera(rig, options, models.kinematics, in_process or drawn)
        self._messages: list[str] = []
        with ExitStack() as opened:
            # Bus and surroundings
            self.clock: Clock = SimulatedClock() if options.fast else RealClock()
            self.scene = scene_of(options)
            self.room: RunRoom | None = None
            if options.world is not None:
                self.room = world().open(rig, options, self.clock)
                self.scene, self.clock = self.room.scene, self.room.clock
            elif self.scene is not None:
                refuse_missing_rules(rig.gaze.top_down, self.scene, f"--scene {options.scene}")
            self.bus: RunBus = self.room.run_bus if self.room else run_bus(rig, options, self.clock)
            opened.callback(self.bus.close)
            # Camera
            now_s, view = self.clock.now_s, self.view
            if camera is not None:
                seen = real_camera(rig, view, options, now_s, detector, camera)
            elif self.room is not None:
                seen = self.room.camera(
                    rig, options, view, random["camera"], detector_of(rig, detector)
                )
            elif self.scene is not None:
                steps = self.bus.true_steps
                head: HeadPose = view.poses.head_pose
                if steps is not None:
                    head = true_head_pose(steps, rig, rig_kinematics(rig))
                seen = scene_camera(
                    rig, view, options, detector, self.scene, head, random["camera"]
                )
            else:
                seen = real_camera(rig, view, options, now_s, detector)
            self.camera = seen
            # Joints and their guard
            sag = None if options.bus == "ideal" else sag_compensation(rig)
            recovered = self._messages.append if options.recover else None
            self.body = Body(self.bus.bus, rig.joints, rig.couplings.values(), sag, recovered)
            self.guard = Guard(
                rig.guard,
                limits(rig.joints),
                self.body.names,
                1.0 / rig.loop.rate_hz,
            )
            # The robot, which joins them in every tick
            self.recorder = _recorder(rig, options) if options.record is not None else None
            wrap_body = self.recorder.wrap_body if self.recorder is not None else wrap_body
            attention = chooser or with_rule(rig, models.attention)
            if rule is not None:
                label = f"attention {type(rule).__name__} of the program"
                attention = RuleChooser(rule, attention, label)
            self.tracks = TrackChoices(
                TrackFiles(options.rig, rig.track_files).read,
                models.animation.tracks,
                track_fit(rig),
                lambda: self.guard.limits,
            )
            body = wrap_body(self.body) if wrap_body is not None else self.body
            commands = CommandExecutor(
                body,
                view.poses,
                attention,
                models.conversation,
                models.lids,
                models.animation,
                self.tracks,
                self.guard,
                self._tune,
                PixelToWorld(view.mount, view.poses, lambda: self.camera_params),
                self._messages,
            )
            self.robot = Robot(
                body,
                models.kinematics,
                seen,
                Perception(
                    view.mount,
                    view.params.horizontal_field_deg,
                    face_parts_m(rig),
                    view.params.lens,
                ),
                view.poses,
                attention,
                models.scanpath,
                models.conversation,
                models.oculomotor,
                models.animation,
                self.guard,
                commands,
                self._messages,
            )
            if self.room is not None and (opponent := self.room.world.scene.opponent) is not None:
                self.robot.set_opponent(opponent, self.room.start_s)
            # What people use while it runs
            self.browser: BrowserCamera | None = None
            if options.mock and not options.fast:
                worker = partial(browser_worker, rig, now_s)
                self.browser = BrowserCamera(worker, now_s, self._look_by, self._messages.append)
                opened.callback(self._close_cameras, self.browser)
            self.voice = RunVoice(
                self.robot.command,
                lambda: self.rig,
                self.clock,
                rig_folder(options.rig),
                options.fast,
                self.robot.report,
            )
            self._opened = opened.pop_all()
        own_walk = rig.gaze.scanpath.transition_matrix not in shipped_names("scanpaths")
        note = row_sums_note(models.walk) if own_walk else None
        self.notes = notes if note is None else (*notes, note)

    def close(self) -> None:
        """End the processes started for it; the robot closes its own camera and bus."""
        self._opened.close()

    @cached_property
    def params(self) -> ParamStore:
        """Return the parameters, which any thread may change.

        Raises:
            gazerig.config.load.ConfigError: the rig's files are invalid now.
        """
        options = self.options
        layers = RigLayers(options.rig, options.character, options.profile)
        return ParamStore(self.rig, self.robot.command, layers)

    @property
    def loop(self) -> LoopParams:
        """Return the rate of the loop."""
        return self.rig.loop

    @property
    def park_rad(self) -> JointAngles:
        """Return the pose for parking, before torque is switched off."""
        park = park_rad(self.rig)
        return tuple(park.get(name, 0.0) for name in self.rig.names)

    @property
    def camera_params(self) -> CameraParams:
        """Return the present lens and placement of the camera; a browser's is fixed."""
        if self.browser is not None and self.browser.in_use:
            return fixed_mount(self.rig.camera, self.models.kinematics)
        return self.view.params

    def shown_rig(self) -> ShownRig:
        """Return the visible structure of the rig."""
        return ShownRig(
            self.models.kinematics, self.view.mount, self.view.field_rad, shape_of(self.rig)
        )

    def scene_start_s(self) -> float | None:
        """Return the start of the scene, None before or without one."""
        if self.room is not None:
            return self.room.start_s()
        return getattr(self.robot.camera, "start_s", None)

    def _tune(self, command: Tune, t_s: float) -> tuple[str, ...]:
        """Apply changed parameters between two ticks, without a jump; return what has changed.

        Keys that a running rig does not apply (see gazerig.config.parameters) keep their values
        until the next start. An invalid change changes nothing.
        """
        old = self.rig
        try:
            new = rig_in_effect(old, apply_changes(old, dict(command.changes)))
            self.models.retune(old, new)
        except ConfigError as error:
            return tuple(f"not tuned: {line}" for line in str(error).splitlines())
        self.rig = new
        self.models.animation.tracks.latency_s = new.gaze.oculomotor.eye_lag_ms / 1e3
        if new.ranges != old.ranges:
            self.guard.start_gently()  # desired angles jump
        lines = [f"tuned: {key} = {value}{start_note(key)}" for key, value in command.changes]
        if new.joints != old.joints or new.guard != old.guard:
            for i in self.guard.retune(new.guard, limits(new.joints)):
                lines.append(
                    f"{self.body.names[i]}: the full range and speed apply at the next start"
                )
        return tuple(lines)

    def _look_by(self, camera: Camera | None) -> None:
        """Use a browser's camera, None for the rig's own."""
        self.robot.camera = self.camera if camera is None else camera
        self.view.mount.retune(self.camera_params)

    def _close_cameras(self, browser: BrowserCamera) -> None:
        """Close a browser's camera, and the rig's own if the robot has not closed it."""
        if browser.in_use:
            self.camera.close()
        browser.close()


def _recorder(rig: Rig, options: RunOptions) -> "Recorder":
    from gazerig.robot.description.export import urdf
    from gazerig.robot.recording.recorder import Recorder  # imports file formats

    assert options.record is not None
    shown = urdf(description_of(rig), looks=False).xml
    return Recorder(options.record, run_info(rig, options), options.force, options.fast, shown)
