"""The command calibrate face: positions of a person's eyes, mouth and other parts."""

import os
import sys
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from gazerig.config.rig import Rig
from gazerig.config.schema import load_rig
from gazerig.drivers.errors import SetupError
from gazerig.features.bringup.calibration.face_steering import (
    PART_NAMES_TEXT,
    FaceCalibration,
    FaceSteering,
    Key,
)
from gazerig.features.bringup.calibration.smart_servo_access import CalibrationStopped
from gazerig.features.bringup.cli.ports import MockOption, PortOption, YesOption
from gazerig.features.bringup.cli.prompts import (
    HELP,
    Lines,
    TerminalKeys,
    TerminalPerson,
    parse_keys,
)
from gazerig.features.bringup.cli.rig_writer import (
    OutOption,
    refuse_unwritable,
    write_values,
)
from gazerig.gaze.attention.idle import REST_M
from gazerig.gaze.attention.top_down import TopDown
from gazerig.robot.cli.terminal import FAULT, RigArgument, clear_errors, record_signals, say
from gazerig.robot.loop.events import TickFeed, group_events
from gazerig.robot.loop.loop import LoopCount, Tick
from gazerig.robot.loop.loop import run as run_loop
from gazerig.robot.loop.power_down import Interrupts
from gazerig.robot.net.socket_server import RemoteServer
from gazerig.robot.run.options import RunOptions
from gazerig.robot.run.requests import RequestHandler
from gazerig.robot.run.run import Run
from gazerig.robot.run.session import prepare_shutdown

STILL_SCENE = "sits-still"

# A script cannot move nearer or turn to the robot, so the waiting time is limited.
_SCRIPT_WAITS_S = 20.0
# Short gaps of a detector are not reported.
_UNSEEN_S = 1.0


def calibrate_face(
    rig: RigArgument = "desk",
    scene: Annotated[
        str | None, typer.Option(help=f"Look at a simulated scene (with --mock: {STILL_SCENE}).")
    ] = None,
    camera: Annotated[int | None, typer.Option(min=0, help="Look through webcam N.")] = None,
    oak: Annotated[bool, typer.Option("--oak", help="Look through an OAK-D camera.")] = False,
    out: OutOption = None,
    yes: YesOption = False,
    answers: Annotated[
        Path | None, typer.Option(help="File with one key per line, e.g. left 3; empty is Enter.")
    ] = None,
    mock: MockOption = False,
    port: PortOption = None,
) -> None:
    """Steer the gaze over your face to each of its parts, and store their positions."""
    with clear_errors(rig, port, mock), record_signals() as stopped:
        loaded = load_rig(rig)
        refuse_unwritable(rig, out)
        lines, by_camera = Lines(answers), camera is not None or oak
        options = RunOptions(
            rig=rig,
            mock=mock,
            # No user watches a script on an emulated rig, so simulated time is sufficient.
            fast=mock and answers is not None and not by_camera,
            seconds=0.0,  # required in simulated time; keys end the run
            scene=scene or (STILL_SCENE if mock and not by_camera else None),
            camera=camera,
            oak=oak,
            port=port,
            no_page=True,
        ).check_and_complete()
        try:
            found = _calibrate(options, loaded, lines, stopped)
            values = found.changed_places()
            if not values:
                say("no part was chosen: nothing to write")
                return
            say("places in mm out of the face, to its owner's left, up:")
            write_values(rig, values, out, TerminalPerson(lines, stopped, yes))
        except CalibrationStopped as why:
            say(f"stopped by {why}: nothing written")
            raise typer.Exit(FAULT) from None


def exact_gaze(rig: Rig) -> Rig:
    """Return a rig whose gaze stays exactly on the part.

    Refixations deviate by up to 1.1 deg, which is as much as ``AIMED_DEG``.
    """
    exact = replace(rig.gaze.oculomotor, law="exact")
    return replace(rig, gaze=replace(rig.gaze, oculomotor=exact))


def _calibrate(
    options: RunOptions, rig: Rig, lines: Lines, stopped: Callable[[], str | None]
) -> FaceCalibration:
    """Let the user steer the gaze from part to part; the rig ends parked, torque off."""
    begin = FaceCalibration(rig.face_parts_mm)
    steering = FaceSteering(begin, TopDown(rig.gaze.top_down), REST_M, "eyes_pan" not in rig.joints)
    made = Run(exact_gaze(rig), options, chooser=steering)
    session = _CalibrationSession(steering, lines, made.clock.now_s, stopped)
    requests = RequestHandler(
        made, session.feed, {"rig": rig.name, "pid": os.getpid()}, calibrated=True
    )
    door = RemoteServer(requests.answer, say)
    say("the head turns to you now, as it always does: keep your fingers out of it;")
    say(f"{HELP}; Ctrl-C writes nothing")
    count = LoopCount(0, 0, "fault: unexpected error")
    try:
        interrupts = Interrupts.from_stop(stopped)
        with ExitStack() as closed_last, prepare_shutdown(made, say, interrupts) as leaving:
            leaving.switch_on(lambda: made.robot.start(made.clock, interrupts.raise_if_requested))
            for note in (*made.notes, *group_events(made.robot.body.bus.events())):
                say(note)
            closed_last.callback(door.close)
            door.open()
            with session.keys or ExitStack():
                count = run_loop(made.robot, made.clock, made.loop, session.over, session.update)
            leaving.cause = count.stopped_by
    finally:
        made.close()
    if stopped() is not None or count.stopped_by.startswith("fault"):
        raise CalibrationStopped(count.stopped_by)
    return steering.state


class _CalibrationSession:
    """Session between the ticks: reads keys, and prints instructions.

    keys: keys of a terminal, None for lines of a file or a pipe, which no user can end
    feed: its ticks, for requests of other programs
    """

    def __init__(
        self,
        steering: FaceSteering,
        lines: Lines,
        now_s: Callable[[], float],
        stopped: Callable[[], str | None],
    ) -> None:
        self._steering, self._lines, self._now_s = steering, lines, now_s
        self._stopped, self.feed = stopped, TickFeed()
        scripted = lines.is_scripted or not sys.stdin.isatty()
        self.keys = None if scripted else TerminalKeys()
        self._script: list[Key] = []
        self._said: tuple[str | None, bool] | None = None
        self._ready_s = self._seen_s = now_s()

    def over(self, _: float) -> str | None:
        """Handle a key; return why the procedure ended, None while it continues.

        Raises:
            SetupError: a script cannot continue.
        """
        steering = self._steering
        if (why := self._stopped()) is not None:
            return why
        if steering.state.part is None:
            return "the last part"
        key = self._next_of_script() if self.keys is None else self.keys.next()
        if key is not None and (refused := steering.press(key)) is not None:
            say(refused)
        return None

    def _next_of_script(self) -> Key | None:
        """Return the next key of a line, after the eyes have finished the previous line."""
        steering, now_s = self._steering, self._now_s()
        if steering.is_aimed:
            self._ready_s = now_s
            if not self._script:
                try:
                    line = self._lines.next(0.0)
                except EOFError:
                    raise SetupError(
                        "no key left: after the last part comes its Enter (an empty line) or end"
                    ) from None
                self._script = [] if line is None else parse_keys(line)
        elif now_s - self._ready_s > _SCRIPT_WAITS_S:
            what = "no face is seen" if steering.face is None else "the eyes cannot reach it"
            raise SetupError(f"{what} for {_SCRIPT_WAITS_S:g} s: keys from a file or pipe end here")
        return self._script.pop(0) if self._script else None

    def update(self, tick: Tick) -> None:
        """Update from a tick, and print instructions for the person."""
        steering = self._steering
        self.feed.update(tick)
        steering.update(tick)
        for event in group_events(tick.events):
            say(event)
        # Name the part once, and report if no face has been seen for a while.
        part, seen = steering.state.part, steering.face is not None
        self._seen_s = tick.t_s if seen else self._seen_s
        lost = tick.t_s - self._seen_s >= _UNSEEN_S
        if part is not None and self._said != (part, seen) and (seen or lost):
            self._said = part, seen
            say(
                f"{PART_NAMES_TEXT[part]}: steer until the gaze meets it, then Enter"
                if seen
                else "no face is seen: sit before the camera, 0.5 to 1.5 m away, and look at it"
            )
