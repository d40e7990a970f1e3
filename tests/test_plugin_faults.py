"""Parts of packages that raise, are slow or return nonsense: one line, and the rig runs on."""

import threading
from dataclasses import replace
from math import inf, nan
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from outside_package import install, on_path

from gazerig.config.parameters import apply_changes
from gazerig.config.schema import load_rig
from gazerig.drivers.bus.checked_bus import CheckedBus
from gazerig.drivers.camera.camera_plugins import CheckedSource
from gazerig.drivers.camera.guarded_camera import GuardedCamera
from gazerig.drivers.camera.source import Shot
from gazerig.drivers.errors import BusLost, CameraError, PluginError
from gazerig.drivers.plugins import ATTENTION
from gazerig.drivers.process.bounded_call import BoundedCall, CallResult
from gazerig.drivers.types import DetectedFace, Detections, Feedback, ServoConfig
from gazerig.drivers.vision.face.detector import CheckedDetector
from gazerig.gaze.types import Target
from gazerig.robot.app.assemble import assemble
from gazerig.robot.app.options import RunOptions
from gazerig.robot.control.chooser import MOST_OVERRUNS, GuardedChooser, to_target

LABEL = "attention 'odd' of odd 1.2"
OWN: Any = Target((2.0, 0.0, 0.5), (0.0, 0.0, 0.0), 0.0, "face", 3, 1.0, True, None, 1, "own")


class Own:
    """The rig's own attention."""

    top_down = SimpleNamespace()

    def reset(self, t_s):
        pass

    def choose(self, percept, state, t_s):
        return OWN


def guarded(answer, longest_s=None):
    said: list[str] = []
    rule = SimpleNamespace(choose=answer)
    own: Any = Own()
    return GuardedChooser(rule, own, LABEL, said.append, longest_s), said


def raising(*_):
    raise KeyError("no\nbody")


# --- who chooses


NONSENSE = [
    (lambda *_: (nan, 0.0, 0.0), "each must be a number within 1e+06"),
    (lambda *_: (1.0, inf, 0.0), "each must be a number within 1e+06"),
    (lambda *_: (1.0, 1e300, 0.0), "each must be a number within 1e+06"),
    (lambda *_: (1.0, 0.0), "wanted a target or a point x, y, z"),
    (lambda *_: "left", "str 'left', wanted a target"),
    (lambda *_: 7, "int '7', wanted a target"),
    (lambda *_: (1.0, 0.0, "up"), "each must be a number"),
    (lambda *_: OWN._replace(salience=nan), "a target with salience nan"),
    (lambda *_: OWN._replace(v_world_m_s=(0.0, nan, 0.0)), "each must be a number"),
    (lambda *_: OWN._replace(centre_world_m=(0.0, nan, 0.0)), "each must be a number"),
    (lambda *_: OWN._replace(id="x"), "whose id is not a whole number"),
    (raising, "failed (KeyError: "),
]


@pytest.mark.parametrize(("answer", "reported"), NONSENSE)
def test_a_rule_that_fails_is_dropped_with_one_line_and_the_rig_chooses(answer, reported):
    chooser, said = guarded(answer)
    for k in range(3):
        assert chooser.choose(None, None, 0.01 * k).p_world_m == OWN.p_world_m
    (line,) = said
    assert line.startswith(LABEL) and reported in line and "\n" not in line
    assert line.endswith(": dropped, the rig's own attention chooses")


def test_a_rule_chooses_points_targets_or_nothing_and_shifts_are_counted():
    answers = iter([(1.0, 0.0, 0.5), np.array([1.01, 0, 0.5]), (1.0, 1.0, 0.5), None, None,
                    OWN._replace(id=9, shift=77)])  # fmt: skip
    chooser, said = guarded(lambda *_: next(answers))
    made = [chooser.choose(None, None, 0.01 * k) for k in range(6)]
    assert [t.p_world_m[:2] for t in made[:3]] == [(1.0, 0.0), (1.01, 0.0), (1.0, 1.0)]
    assert [t.kind for t in made] == ["point"] * 3 + ["face"] * 3
    # A near point is the same thing, a far one another.
    shifts = [t.shift for t in made]
    assert [b - a for a, b in zip(shifts, shifts[1:], strict=False)] == [0, 1, 1, 0, 1]
    assert said == []


def test_a_rule_that_blocks_costs_the_loop_its_patience_only_and_is_dropped():
    gate = threading.Event()
    chooser, said = guarded(lambda *_: gate.wait(60.0), longest_s=0.001)
    while not said:
        assert chooser.choose(None, None, 0.0).id == OWN.id
    gate.set()
    assert chooser.choose(None, None, 0.0).id == OWN.id
    (line,) = said
    assert line.startswith(f"{LABEL} has not answered for 0.25 s: dropped")


def answering(took_s):
    """Return a chooser whose rule answers a point after these times."""
    chooser, said = guarded(lambda *_: None)
    point = to_target((1.0, 0.0, 0.5), 0.0)
    outcomes = iter(CallResult(point, None, one) for one in took_s)
    chooser._call = type("Call", (), {
        "__call__": lambda self, work: next(outcomes), "running_s": lambda self: 0.0,
        "close": lambda self: None,
    })()  # fmt: skip
    return chooser, said


def test_a_rule_that_is_slow_again_and_again_is_dropped():
    chooser, said = answering([0.01] * 20)
    kinds = [chooser.choose(None, None, 0.1 * k).kind for k in range(10)]
    assert kinds == ["point"] * (MOST_OVERRUNS - 1) + ["face"] * (11 - MOST_OVERRUNS)
    (line,) = said
    assert line.startswith(f"{LABEL} took longer than 1 ms {MOST_OVERRUNS} times in a second")


@pytest.mark.parametrize(("took_s", "apart_s"), [(0.01, 0.3), (0.0005, 0.001)])
def test_overruns_far_apart_and_time_that_is_the_machines_are_forgiven(took_s, apart_s):
    chooser, said = answering([took_s] * 50)
    for k in range(40):
        assert chooser.choose(None, None, apart_s * k).kind == "point"
    assert said == []


def test_a_late_answer_is_used_when_it_comes():
    gate, begun = threading.Event(), threading.Event()

    def slow():
        begun.set()
        gate.wait(60.0)
        return 5

    call = BoundedCall("test", 0.001)
    assert call(slow) is None
    assert call(lambda: 6) is None
    begun.wait(60.0)
    gate.set()
    while (outcome := call(lambda: 6)) is None:
        pass
    assert outcome.value == 5
    while (outcome := call(lambda: 7)) is None:
        pass
    assert outcome.value == 7
    call.close()


RULES = {
    "nan": "return (float('nan'), 0.0, 0.0)",
    "raise": "raise ValueError('no idea')",
    "point": "return (2.0, 1.0, 0.6)",
}


@pytest.mark.parametrize("name", RULES)
def test_a_whole_rig_runs_on_without_a_rule_and_nan_reaches_no_joint(tmp_path, name):
    source = f"""
        class Rule:
            def choose(self, percept, state, t_s):
                if t_s > 0.5:
                    {RULES[name]}
    """
    with on_path(tmp_path):
        install(tmp_path, "odd", {ATTENTION: {"odd": "odd_rule:Rule"}}, {"odd_rule": source})
        rig = apply_changes(load_rig("desk"), {"gaze.chooser": "odd"})
        made = assemble(rig, RunOptions(mock=True, fast=True, seed=0, scene="visitor"))
        events: list[str] = []
        kinds: set[str] = set()
        made.robot.start(made.clock)
        for k in range(1, 200):
            made.clock.sleep_until(k * 0.005)
            tick = made.robot.tick(made.clock.now_s(), 0.005)
            events += tick.events
            kinds.add(tick.target.kind)
            assert np.isfinite(tick.guard_result.command_rad).all()
            assert np.isfinite(tick.desired_rad).all()
        made.robot.stop()
        made.close()
    reported = [line for line in events if "odd 1.2" in line]
    assert len(reported) == (name != "point"), reported
    assert ("point" in kinds) == (name == "point")


# --- a camera


SHOT: Any = Shot
NO_IMAGE: Any = None


class Camera:
    """A camera that returns given values."""

    def __init__(self, *answers):
        self.answers, self.closed = list(answers), 0

    def open(self):
        pass

    def latest(self, now_s):
        answer = self.answers.pop(0)
        if isinstance(answer, BaseException):
            raise answer
        return answer

    def events(self):
        return ()

    def close(self):
        self.closed += 1


SEEN: Any = Detections(1.0, 1, 640, 480)
FACE: Any = DetectedFace((1.0, 2.0, 30.0, 40.0), np.ones((5, 2)), 0.9)


@pytest.mark.parametrize(
    ("answer", "reported"),
    [
        (7, "returned a int, wanted Detections or None"),
        (RuntimeError("cable"), "failed (RuntimeError: cable)"),
        (SystemExit(1), "failed (SystemExit: 1)"),
        (CameraError("fell off"), "failed (CameraError: fell off)"),
        (replace(SEEN, captured_s=nan), "returned captured_s nan"),
        (replace(SEEN, number=1.5), "number 1.5"),
        (replace(SEEN, width_px=0), "a frame of 0 x 480"),
        (replace(SEEN, faces=(1,)), "returned a int as a face"),
        (replace(SEEN, faces=7), "detections that cannot be read"),
        (replace(SEEN, faces=(replace(FACE, box_px=(nan, 1.0, 2.0, 3.0)),)), "a face with the box"),
        (replace(SEEN, faces=(replace(FACE, landmarks_px=np.full((5, 2), nan)),)), "five finite"),
        (replace(SEEN, faces=(replace(FACE, landmarks_px=np.ones((4, 2))),)), "five finite"),
        (replace(SEEN, blobs=("x",)), "a thing 'x'"),
    ],
)
def test_a_camera_that_fails_leaves_the_rig_without_frames(answer, reported):
    camera = GuardedCamera(Camera(SEEN, answer, SEEN), "camera 'fish' of fish 2", None)
    camera.open()
    assert camera.latest(1.0) is SEEN
    assert camera.latest(1.1) is None
    assert camera.latest(1.2) is None
    (line,) = camera.events()
    assert line.startswith("camera 'fish' of fish 2 ") and reported in line
    assert line.endswith(": the rig continues without frames")
    camera.close()
    camera.close()


def test_a_camera_that_blocks_keeps_its_last_frame_and_is_reported_once():
    gate = threading.Event()
    inner: Any = Camera(SEEN)
    camera = GuardedCamera(inner, "camera 'fish' of fish 2", 0.001)
    inner.latest = lambda now_s: gate.wait(60.0) and SEEN
    camera.open()
    for k in range(300):
        assert camera.latest(0.01 * k) is None
    assert camera.events() == ("camera 'fish' of fish 2 has not answered for 1 s: no new frames",)
    gate.set()
    while camera.latest(4.0) is None:
        pass
    assert camera.events() == ("camera 'fish' of fish 2 answers again",)


def test_a_camera_that_cannot_be_opened_refuses_the_start():
    camera: Any = Camera()
    for error, kind, reported in (
        (CameraError("no such camera: plug it in"), CameraError, "^no such camera: plug it in$"),
        (OSError("bus\nerror"), PluginError, "^fish cannot be opened: OSError: bus error$"),
    ):

        def fails(error=error):
            raise error

        camera.open = fails
        with pytest.raises(kind, match=reported):
            GuardedCamera(camera, "fish", None).open()


@pytest.mark.parametrize(
    ("answer", "reported"),
    [
        (7, "returned a int, wanted a Shot"),
        (SHOT(nan, 1, np.zeros((4, 4, 3), np.uint8)), "a frame of the time nan"),
        (SHOT(1e9, 1, np.zeros((4, 4, 3), np.uint8)), "a frame of the time 1000000000.0"),
        (SHOT(1.0, 1, np.zeros((4, 4, 3))), "not an image of 8 or 16 bits"),
        (SHOT(1.0, 1, "picture"), "not an image"),
        (RuntimeError("cable"), "failed (RuntimeError: cable)"),
    ],
)
def test_a_source_that_returns_nonsense_is_named(answer, reported):
    def take(now_s, stop):
        if isinstance(answer, Exception):
            raise answer
        return answer

    source = CheckedSource(SimpleNamespace(take=take), "camera 'fish' of fish 2")
    with pytest.raises(CameraError) as caught:
        source.take(lambda: 1.0, threading.Event())
    assert str(caught.value).startswith("camera 'fish' of fish 2 ") and reported in str(
        caught.value
    )


# --- a detector


@pytest.mark.parametrize(
    ("answer", "reported"),
    [
        (lambda image: 7, "failed (TypeError"),
        (lambda image: [1], "returned a int as a face"),
        (lambda image: [replace(FACE, confidence=nan)], "returned a face with"),
        (raising, "failed (KeyError"),
    ],
)
def test_a_detector_that_fails_is_replaced_by_ours(answer, reported):
    ours = SimpleNamespace(find=lambda image: (FACE,))
    detector = CheckedDetector(SimpleNamespace(find=answer), "detector 'd' of d 1", lambda: ours)
    assert detector.find(NO_IMAGE) == (FACE,)
    assert detector.find(NO_IMAGE) == (FACE,)
    (line,) = detector.events()
    assert line.startswith("detector 'd' of d 1 ") and reported in line
    assert line.endswith(": it is no longer used, mtcnn finds the faces")


# A bus of a package that raises, is slow or reads nonsense: it is named, no torque stays on


SERVOS = (ServoConfig(1, "m", 0, 1000, 500.0, "neck"), ServoConfig(2, "m", 0, 1000, 500.0, "jaw"))
GOOD: Any = Feedback.create_missing(2)._replace(
    position_steps=(500.0, 400.0), velocity_steps_s=(0.0, 0.0), load=(0.0, 0.0), at_s=(1.0, 1.0),
    torque=(True, True), missing=(),
)  # fmt: skip


def checked(**methods):
    said = SimpleNamespace(events=lambda: (), faults=lambda: (), **methods)
    return CheckedBus(said, "bus 'b' of b 1", SERVOS)


@pytest.mark.parametrize(
    ("answer", "reported"),
    [
        (lambda now_s: None, "read returned a NoneType, wanted Feedback"),
        (lambda now_s: (1, 2, 3), "read returned a tuple, wanted Feedback"),
        (lambda now_s: Feedback.create_missing(1), "1 values of position_steps for 2 servos"),
        (lambda now_s: GOOD._replace(torque=(True,)), "1 values of torque for 2 servos"),
        (lambda now_s: GOOD._replace(load=7), "object of type 'int' has no len"),
        (lambda now_s: GOOD._replace(missing=(5,)), "missing [5] of 2 servos"),
        (lambda now_s: GOOD._replace(position_steps=("a", 1.0)), "must be real number"),
        (raising, "read failed (KeyError"),
    ],
)
def test_a_bus_that_reads_nonsense_ends_the_run_with_its_name(answer, reported):
    with pytest.raises(BusLost) as caught:
        checked(read=answer).read(1.0)
    assert str(caught.value).startswith("bus 'b' of b 1: ") and reported in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("column", ["position_steps", "velocity_steps_s", "load", "at_s"])
@pytest.mark.parametrize("value", [nan, inf])
def test_a_servo_without_a_finite_reading_counts_as_missing(column, value):
    bus = checked(read=lambda now_s: GOOD._replace(**{column: (1.0, value)}))
    for k in range(5):
        reported = bus.read(1.0 + 0.01 * k)
        assert reported.missing == (1,) and reported.position_steps[0] == (
            1.0 if "pos" in column else 500.0
        )
        assert not reported.torque[1]
    assert bus.events() == (
        "bus 'b' of b 1: no finite position, speed, load or time of jaw (servo 2): taken as missing",
    )


def test_a_read_that_takes_a_tick_is_reported_seldom():
    clock = [0.0]

    def slow(now_s):
        clock[0] += 0.02
        return GOOD

    bus = CheckedBus(
        SimpleNamespace(read=slow, events=lambda: ()), "bus 'b' of b 1", SERVOS, lambda: clock[0]
    )
    for _ in range(100):
        bus.read(clock[0])
    (line,) = bus.events()
    assert line == "bus 'b' of b 1: a read took 20 ms, as long as a tick: lower loop.rate_hz"


def test_goals_are_clipped_and_checked_whatever_the_bus_does():
    sent: list[list[int]] = []
    bus = checked(write=sent.append)
    bus.write([-50, 1e9])
    assert sent == [[0, 1000]]
    for wrong in ([nan, 1], [1], [1, 2, 3]):
        with pytest.raises(ValueError):
            bus.write(wrong)
    assert len(sent) == 1


@pytest.mark.parametrize("goals", [None, (1,), (500, nan), (500, 4000), "no"])
def test_torque_with_a_goal_outside_is_taken_off_again(goals):
    released = []
    bus = checked(enable_torque=lambda: goals, disable_torque=lambda: released.append(1))
    with pytest.raises(BusLost, match="enable_torque returned no goal within limits"):
        bus.enable_torque()
    assert released


def test_a_bus_that_cannot_release_says_to_cut_the_power():
    with pytest.raises(
        BusLost, match=r"disable_torque failed \(KeyError.*\): cut the servo power$"
    ):
        checked(disable_torque=raising).disable_torque()
