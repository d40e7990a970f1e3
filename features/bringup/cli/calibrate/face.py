"""The command calibrate face: positions of a person's eyes, mouth and other parts."""

import sys
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from gazerig.config.rig import Rig
from gazerig.config.schema import load_rig
from gazerig.drivers.errors import SetupError
from gazerig.features.bringup.calibration.face_steering import (
    PART_NAMES_TEXT,
    FaceCalibration,
    FaceSteering,
    changed_places,
    initial_calibration,
)
from gazerig.features.bringup.calibration.smart_servo_access import CalibrationStopped
from gazerig.features.bringup.cli.calibration_keys import (
    HELP,
    Keys,
    LineKeys,
    TerminalKeys,
)
from gazerig.features.bringup.cli.ports import MockOption, PortOption
from gazerig.features.bringup.cli.prompts import Lines, TerminalPerson
from gazerig.features.bringup.cli.rig_writer import (
    AllYesOption,
    OutOption,
    refuse_unwritable,
    write_values,
)
from gazerig.gaze.attention.idle import REST_M
from gazerig.gaze.attention.top_down import TopDown
from gazerig.gaze.types import Vec3
from gazerig.robot.app.assemble import Substitutes, assemble
from gazerig.robot.app.options import RunOptions
from gazerig.robot.app.run_observers import RunObservers
from gazerig.robot.app.session import prepare_shutdown
from gazerig.robot.cli.console import Console
from gazerig.robot.cli.terminal import FAULT, RigArgument, clear_errors, record_signals, say, status
from gazerig.robot.control.event_text import group_events
from gazerig.robot.control.interrupts import Interrupts
from gazerig.robot.control.loop import LoopCount, Tick
from gazerig.robot.control.loop import run as run_loop

STILL_SCENE = "sits-still"

# A script cannot move nearer or turn to the robot, so the waiting time is limited.
_SCRIPT_WAITS_S = 20.0
_SHOW_S = 0.1
# Short gaps of a detector are not reported.
_UNSEEN_S = 1.0


def calibrate_face(
    rig: RigArgument = "desk",
    scene: Annotated[
        str | None, typer.Option(help=f"Look at a simulated scene (with --mock: {STILL_SCENE}).")
    ] = None,
    video: Annotated[
        Path | None, typer.Option(help="Look at a photo or a film, in a loop.")
    ] = None,
    camera: Annotated[int | None, typer.Option(min=0, help="Look through webcam N.")] = None,
    oak: Annotated[bool, typer.Option("--oak", help="Look through an OAK-D camera.")] = False,
    out: OutOption = None,
    yes: AllYesOption = False,
    answers: Annotated[
        Path | None, typer.Option(help="File with one key per line, e.g. left 3; empty is Enter.")
    ] = None,
    page: Annotated[
        str,
        typer.Option(
            metavar="HOST:PORT",
            help="Where a page with the same keys is served. Other machines reach it at "
            "0.0.0.0:8080. It opens with the token in the address that is printed at start.",
        ),
    ] = "127.0.0.1:8080",
    no_page: Annotated[
        bool, typer.Option("--no-page", help="Serve no page, as with --answers.")
    ] = False,
    mock: MockOption = False,
    port: PortOption = None,
) -> None:
    """Steer the gaze over your face to each of its parts, and store their positions."""
    with clear_errors(rig, port, mock), record_signals() as stopped:
        loaded = load_rig(rig)
        refuse_unwritable(rig, out)
        lines = Lines(answers)
        nothing = scene is None and video is None and camera is None and not oak
        options = RunOptions(
            rig=rig,
            mock=mock,
            # No user watches a script on an emulated rig, so simulated time is sufficient.
            fast=mock and answers is not None and camera is None and not oak,
            seconds=0.0,  # required in simulated time; keys end the run
            scene=STILL_SCENE if mock and nothing else scene,
            video=video,
            camera=camera,
            oak=oak,
            port=port,
            page=page,
            no_page=no_page or answers is not None,
        ).check_and_complete()
        try:
            found = _calibrate(options, loaded, lines, answers is not None, stopped)
            values = changed_places(found)
            if not values:
                say("no part was chosen: nothing to write")
                return
            Console().print(_table(rig, loaded, found))
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
    options: RunOptions, rig: Rig, lines: Lines, scripted: bool, stopped: Callable[[], str | None]
) -> FaceCalibration:
    """Let the user steer the gaze from part to part; the rig ends parked, torque off."""
    begin = initial_calibration(rig.face_parts_mm)
    steering = FaceSteering(begin, TopDown(rig.gaze.top_down), REST_M, "eyes_pan" not in rig.joints)
    made = assemble(exact_gaze(rig), options, Substitutes(chooser=lambda own: steering))
    # Input from a pipe is also a script: no user can end it.
    scripted = scripted or not sys.stdin.isatty()
    keys = LineKeys(lines) if scripted else TerminalKeys()
    observers = RunObservers(made, options, say, led_by="the terminal")
    sitting = _CalibrationSession(steering, keys, made.clock.now_s, stopped, scripted, observers)
    say("the head turns to you now, as it always does: keep your fingers out of it;")
    say(f"{HELP}; Ctrl-C writes nothing")
    try:
        interrupts, count = (
            Interrupts.from_stop(stopped),
            LoopCount(0, 0, "fault: unexpected error"),
        )
        with ExitStack() as closed_last, prepare_shutdown(made, say, interrupts) as leaving:
            leaving.switch_on(lambda: made.robot.start(made.clock, interrupts.raise_if_requested))
            for note in (*made.notes, *group_events(made.robot.body.bus.events())):
                say(note)
            closed_last.callback(lambda: observers.close(count))
            observers.open()
            with keys:
                count = run_loop(made.robot, made.clock, made.loop, sitting.over, sitting.update)
            leaving.cause = count.stopped_by
    finally:
        made.close()
    if stopped() is not None or count.stopped_by.startswith("fault"):
        raise CalibrationStopped(count.stopped_by)
    return steering.state


class _CalibrationSession:
    """Session between the ticks: reads keys, and prints text on the terminal and the page."""

    def __init__(
        self,
        steering: FaceSteering,
        keys: Keys,
        now_s: Callable[[], float],
        stopped: Callable[[], str | None],
        scripted: bool,
        observers: RunObservers,
    ) -> None:
        self._steering, self._keys, self._now_s = steering, keys, now_s
        self._stopped, self._scripted = stopped, scripted
        self._observers = observers
        self._live_line = not scripted and sys.stderr.isatty()
        self._said: tuple[str | None, bool] | None = None
        self._ready_s = self._shown_s = self._seen_s = now_s()

    def over(self, _: float) -> str | None:
        """Handle a key; return why the procedure ended, None while it continues.

        Raises:
            SetupError: a script cannot continue.
        """
        steering, now_s = self._steering, self._now_s()
        if (why := self._stopped()) is not None:
            return why
        if steering.state.part is None:
            return "you" if steering.state.part_number < len(PART_NAMES_TEXT) else "the last part"
        if steering.is_aimed:
            self._ready_s = now_s
        if self._scripted and now_s - self._ready_s > _SCRIPT_WAITS_S:
            what = "no face is seen" if steering.face is None else "the eyes cannot reach it"
            raise SetupError(f"{what} for {_SCRIPT_WAITS_S:g} s: keys from a file or pipe end here")
        key = self._keys.next(steering.is_aimed)
        if key is not None:
            self._tell(steering.press(key, now_s))
        return None

    def update(self, tick: Tick) -> None:
        """Update from a tick, and print instructions for the person."""
        self._observers.update(tick)
        self._tell(self._steering.update(tick))
        for event in group_events(tick.events):
            say(event)
        # Name the part once, and report if no face has been seen for a while.
        part, seen = self._steering.state.part, self._steering.face is not None
        self._seen_s = tick.t_s if seen else self._seen_s
        due = part is not None and self._said != (part, seen)
        if part is not None and due and seen:
            self._said = part, seen
            self._tell(f"{PART_NAMES_TEXT[part]}: steer until the gaze meets it, then Enter")
        elif due and tick.t_s - self._seen_s >= _UNSEEN_S:
            self._said = part, seen
            self._tell("no face is seen: sit before the camera, 0.5 to 1.5 m away, and look at it")
        if self._live_line and tick.t_s - self._shown_s >= _SHOW_S:
            self._shown_s = tick.t_s
            status(status_text(self._steering))

    def _tell(self, what: str | None) -> None:
        if what is not None:
            say(what)


def status_text(steering: FaceSteering) -> str:
    """Return the status line: part, distance moved, step."""
    state = steering.state
    if state.part is None or steering.face is None:
        return "no face is seen"
    left, up = state.moved_mm(state.part)
    across = f"{abs(left):g} mm {'left' if left > 0.0 else 'right'}" if left else "0 mm across"
    upright = f"{abs(up):g} mm {'up' if up > 0.0 else 'down'}" if up else "0 mm up"
    return (
        f"{state.part_number + 1}/{len(PART_NAMES_TEXT)} {PART_NAMES_TEXT[state.part]}: {across}, {upright}; "
        f"step {state.step_mm:g} mm"
    )


def _table(rig: str, loaded: Rig, found: FaceCalibration) -> Table:
    table = Table(caption=f"places in mm out of the face, to its owner's left, up; against {rig}")
    for name in ("part", "old", "new"):
        table.add_column(name, justify="left" if name == "part" else "right", no_wrap=True)
    for key, new in changed_places(found).items():
        part = key.rpartition(".")[2]
        old = loaded.face_parts_mm.get(part)
        table.add_row(part, _numbers(old) if old is not None else "an adult's", _numbers(new))
    return table


def _numbers(place_mm: Vec3) -> str:
    return " ".join(f"{v:g}" for v in place_mm)
