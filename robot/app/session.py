"""One run from start to torque off: what the command line asks for, carried out."""

import contextlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from gazerig.drivers.errors import SetupError
from gazerig.robot.analysis.behaviour_score import Behaviours
from gazerig.robot.analysis.gaze_on_face import FaceGaze
from gazerig.robot.analysis.heatmap import heatmap
from gazerig.robot.analysis.summary import Summary
from gazerig.robot.app.assemble import Assembly
from gazerig.robot.app.options import Choice
from gazerig.robot.app.run_observers import Audience, Told, Wished
from gazerig.robot.app.scripted_behaviour import Planner
from gazerig.robot.control.event_text import drawn_together
from gazerig.robot.control.interrupts import Interrupts
from gazerig.robot.control.joint_faults import JointFaults
from gazerig.robot.control.loop import LoopCount, Robot, Tick
from gazerig.robot.control.loop import run as run_loop
from gazerig.robot.control.observers import Observers
from gazerig.robot.control.power_down import Again, PowerDown
from gazerig.robot.model.clock import RealClock


@dataclass(frozen=True)
class Wanted:
    """What was asked for on the command line; None where nothing was said."""

    mock: bool = False
    fast: bool = False
    seed: int = 0
    seconds: float | None = None
    scene: str | None = None
    video: Path | None = None
    camera: int | None = None
    oak: bool = False
    replay: Path | None = None
    pixels: bool = False
    scanpath: str | None = None
    saccade: str | None = None
    rules: str | None = None
    port: str | None = None
    asked: tuple[tuple[str, str], ...] = ()
    heatmap: Path | None = None
    heatmap_face: Path | None = None
    watched: Wished = Wished()

    def choice(self) -> Choice:
        """Return what to assemble.

        Raises:
            SetupError: the options do not fit together.
        """
        asked = [
            name
            for name in ("scene", "video", "camera", "oak", "replay")
            # By identity: webcam 0 is a choice.
            if getattr(self, name) is not None and getattr(self, name) is not False
        ]
        if len(asked) > 1:
            options = " and ".join(f"--{name}" for name in asked)
            raise SetupError(f"{options} exclude each other: the head looks at one of them")
        scene = self.scene
        if not asked:
            if not self.mock:
                raise SetupError(
                    "nothing to look at: give --oak, --camera N, --video FILE or --scene NAME"
                )
            scene = "visitor"
        if self.port is not None and self.mock:
            raise SetupError("--port and --mock exclude each other: --mock has a port of its own")
        if self.fast and not self.mock:
            raise SetupError("--fast needs --mock: real servos cannot be hurried")
        if self.fast and (self.camera is not None or self.oak):
            raise SetupError("--fast needs a scene, a film or a recording: a camera has real time")
        if self.pixels and scene is None:
            raise SetupError("--pixels draws a scene: it cannot be used with a film or a camera")
        if self.fast and self.seconds is None and scene is None:
            raise SetupError("--fast needs --seconds S with a film: it would never end")
        return Choice(
            mock=self.mock,
            fast=self.fast,
            seed=self.seed,
            scene=scene,
            video=self.video,
            camera=self.camera,
            oak=self.oak,
            replay=self.replay,
            pixels=self.pixels,
            scanpath=self.scanpath,
            saccade=self.saccade,
            rules=self.rules,
            port=self.port,
        )


def run(
    made: Assembly,
    wanted: Wanted,
    stopped: Callable[[], str | None],
    say: Callable[[str], None],
    status: Callable[[str], None],
    told: Told | None = None,
) -> dict[str, object]:
    """Run until the time is over, a signal comes or something fails; give the figures.

    stopped: gives the name of a signal that has come; say, status: write a line, and
    rewrite the status line
    told: what tuning and recording need, None where there is neither
    Raises:
        SetupError: before anything moved.
    """
    try:
        return _run(made, wanted, stopped, say, status, told)
    finally:
        made.close()


def _run(
    made: Assembly,
    wanted: Wanted,
    stopped: Callable[[], str | None],
    say: Callable[[str], None],
    status: Callable[[str], None],
    told: Told | None,
) -> dict[str, object]:
    robot, wall = made.robot, RealClock()
    say = _never_raising(say)
    audience = Audience(made, wanted.watched, told, wanted.fast, say, status)
    summary = Summary()
    faults = JointFaults(say)
    scene = made.scene
    score = Behaviours(scene.events(), scene.round_s) if scene is not None else None
    face_gaze = FaceGaze() if wanted.heatmap is not None else None
    observers = Observers(say)
    observers.add("the summary", summary.note)
    observers.add("the watch for faults", faults.note)
    audience.join(observers)
    _observe_scene(observers, made, score, face_gaze)
    _ask_all(robot, wanted)

    def tell(tick: Tick) -> None:
        for event in (*drawn_together(tick.events), *audience.events()):
            say(f"{tick.t_s - start_s:.2f} s: {event}")

    observers.add("the log", tell)
    longest_s = _longest_s(made, wanted)
    interrupts = Interrupts.of(stopped)

    def stop(seconds: float) -> str | None:
        over = longest_s is not None and seconds >= longest_s - 1e-9
        return stopped() or interrupts() or ("seconds" if over else None)

    began_s = wall.now_s()
    count = LoopCount(0, 0, "fault: unexpected error")
    audience.open_files()
    begun = False
    try:
        with interrupts, way_out(made, say, interrupts) as leaving:
            leaving.switch_on(lambda: robot.start(made.clock, interrupts.refuse))
            begun = True
            start_s = made.clock.now_s()
            for note in (*made.notes, *drawn_together(robot.body.bus.events())):
                say(note)
            audience.open()
            count = run_loop(
                robot, made.clock, lambda: made.loop, audience.timed(stop), observers.note
            )
            wall_s = wall.now_s() - began_s
            leaving.cause = count.stopped_by
    finally:
        if begun:
            audience.close(count)
        else:
            audience.give_up()
    faults.close()
    figures = _figures(made, summary, score, count, wall_s, faults)
    unwritten = audience.unwritten()
    if face_gaze is not None and wanted.heatmap is not None:
        try:
            _draw_heatmap(face_gaze, wanted, wanted.heatmap, say)
        except SetupError as error:  # the figures of the run are still to be had
            say(str(error))
            unwritten = wanted.heatmap
    if unwritten is not None:
        figures["not_written"] = str(unwritten)
    return figures


def _observe_scene(
    observers: Observers, made: Assembly, score: Behaviours | None, face_gaze: FaceGaze | None
) -> None:
    """Add what a scene plans and scores, and the heat map, where there are any."""
    if made.scene is not None and score is not None:
        planner = Planner(made.scene.behaviour, made.robot.ask)
        observers.add("the scene's planner", lambda tick: planner.note(tick.t_s))
        observers.add("the scene's score", score.note)
    if face_gaze is not None:
        observers.add("the heat map", face_gaze.note)


def _never_raising(say: Callable[[str], None]) -> Callable[[str], None]:
    """Return ``say`` so that a failure to say something ends nothing."""

    def tried(line: str) -> None:
        with contextlib.suppress(Exception):
            say(line)

    return tried


def _longest_s(made: Assembly, wanted: Wanted) -> float | None:
    """Return how long to run: as asked, or one whole round of a scene in simulated time."""
    if wanted.seconds is None and wanted.fast and made.scene is not None:
        return made.scene.round_s + 1.0  # and how the round ends
    return wanted.seconds


def _ask_all(robot: Robot, wanted: Wanted) -> None:
    """Ask for what the command line wants in force at the start."""
    try:
        for menu, choice in wanted.asked:
            robot.ask(menu, choice)
    except ValueError as error:
        raise SetupError(str(error)) from error


def _draw_heatmap(
    face_gaze: FaceGaze, wanted: Wanted, out: Path, say: Callable[[str], None]
) -> None:
    """Write the heat map, or say why there is none."""
    if not face_gaze.points_face_m:
        say(f"no heat map in {out}: no face was looked at")
        return
    points, seconds = np.array(face_gaze.points_face_m), np.array(face_gaze.seconds)
    heatmap(points, seconds, out, wanted.heatmap_face, wanted.watched.over)
    say(f"heat map of {sum(face_gaze.seconds):.1f} s on the face in {out}")


def leave(
    made: Assembly,
    count: LoopCount,
    say: Callable[[str], None],
    interrupts: Interrupts | None = None,
) -> None:
    """Park, torque off, close, and say what of it worked: power_down.py's end alone."""
    leaving = way_out(made, say, interrupts if interrupts is not None else Interrupts())
    leaving.cause = count.stopped_by
    leaving.leave()


def way_out(made: Assembly, say: Callable[[str], None], interrupts: Interrupts) -> PowerDown:
    """Return the way out of a run of this robot."""
    return PowerDown(lambda again: parked(made, again), made.robot.stop, say, interrupts)


def parked(made: Assembly, again: Again) -> str:
    """Park a robot unless it was stopped; return what to say of it."""
    robot = made.robot
    if robot.stopped:
        return "not parked, as it was stopped"
    if robot.park(made.park_rad, made.clock, made.loop, again):
        return "parked"
    return "not parked (interrupted)" if again() else "not parked"


def _figures(
    made: Assembly,
    summary: Summary,
    score: Behaviours | None,
    count: LoopCount,
    wall_s: float,
    faults: JointFaults,
) -> dict[str, object]:
    """Join the figures of the ticks, the loop, the pictures and the bus."""
    robot = made.robot
    health = robot.body.bus.health()
    bus: dict[str, object] = {
        "tx_bytes": health.tx_bytes,
        "rx_bytes": health.rx_bytes,
        "errors": {kind: n for kind, n in sorted(health.errors.items()) if n},
    }
    digest = made.sent_digest()
    if digest is not None:
        bus["tx_sha256"] = digest
    ticks = summary.figures()
    if score is not None and (behaviours := score.figures()):
        ticks["behaviours"] = behaviours
    return {
        "seconds": ticks.pop("seconds"),
        "wall_seconds": round(wall_s, 3),
        "ticks": count.ticks,
        "overruns": count.overruns,
        "faces_seen": robot.perception.pictures_with_face,
        "pictures": robot.perception.pictures,
        "head_turn_residual": robot.perception.residual()._asdict(),
        **ticks,
        "joint_faults": faults.figures(),
        "bus": bus,
        "stopped_by": count.stopped_by,
    }
