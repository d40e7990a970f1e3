"""Requests of a program to a head in simulated time: orders and their ends, values, parameters."""

from collections.abc import Iterator
from contextlib import suppress
from math import degrees, nan
from typing import Any

import numpy as np
import pytest
from slow_rigs import at_rate

import gazerig
from gazerig.gaze.types import GazeState, Percept, Vec3
from gazerig.robot.recording.read import RunRecording
from gazerig.robot.run.rerun import rerun

pytestmark = pytest.mark.usefixtures("ideal_servos")


@pytest.fixture
def head() -> Iterator[gazerig.SimulatedHead]:
    with gazerig.open("desk", fast=True, scene="face-to-face") as head:
        head.step(2.0)
        yield head


def test_orders_arrive_are_taken_over_and_end(head):
    began_s = head.time_s
    order = head.look_at(1.0, 0.5, 0.3)
    assert order.outcome is None and head.time_s == began_s  # time passes only when stepped
    assert order.wait() == "arrived" and not order.refused and order.why == ""
    assert 0.02 < head.time_s - began_s < 1.5
    assert order.active and head.state.controlled_by == "the program: look at 1 0.5 0.3"
    assert degrees(gaze_error(head, (1.0, 0.5, 0.3))) < 1.0
    first = head.look_at(1.0, 1.0, 0.3)
    second = head.look_towards(-10.0, 5.0)
    assert first.wait() == "taken over" and "look in direction -10.0 5.0" in first.why
    assert second.wait() == "arrived"
    assert head.gaze.direction_deg == pytest.approx((-10.0, 5.0), abs=1.0)
    # An arrived order stays so, whatever follows.
    head.look_freely().wait()
    assert second.outcome == "arrived" and not second.active
    order = head.look_at(1.0, 0.4, 0.3)
    head.step(0.5)
    assert order.active
    order.end()
    head.step()
    assert not order.active and head.state.controlled_by == ""
    timed = head.look_at(1.0, 1.0, 0.3, for_s=0.05)
    assert timed.wait() == "taken over" and timed.why == "its time is over"


def gaze_error(head: gazerig.Head, point: Vec3) -> float:
    """Return the angle between the measured gaze and a point."""
    gaze = head.gaze
    to = np.subtract(point, gaze.head_m)
    yaw, pitch = gaze.direction_rad
    sight = (np.cos(pitch) * np.cos(yaw), np.cos(pitch) * np.sin(yaw), np.sin(pitch))
    return float(np.arccos(np.dot(sight, to / np.linalg.norm(to))))


def test_a_point_out_of_reach_is_told_when_the_head_rests_as_near_as_it_can(head):
    began_s = head.time_s
    order = head.look_at(-1.0, 0.1, 0.3)
    assert order.wait() == "out of reach" and head.time_s - began_s < 5.0
    off_deg = float(order.why.partition(" deg off: ")[0])
    assert off_deg > 30.0 and "head yaw 70 of " in order.why and order.active
    head.step(3.0)
    assert order.active and order.outcome == "out of reach"
    rests = gaze_error(head, (-1.0, 0.1, 0.3))
    assert degrees(rests) == pytest.approx(off_deg, abs=3.0)


REFUSED = (
    (lambda head: head.look_at(nan, 0.0, 0.0), "look_at: .*p_world_m"),
    (lambda head: head.jog("nose", 1.0), "no joint 'nose'"),
    (lambda head: head.express("smug"), "no expression 'smug'"),
    (lambda head: head.move_opponent(0.7, 0.0, 0.0), "no opponent to move"),
    (lambda head: head.get("gaze.hed"), "no key .hed."),
    (lambda head: head.save(), "is part of the program and is never changed"),
    (lambda head: next(head.states(0.0)), "above 0"),
)


def test_what_cannot_be_meant_is_refused_and_values_are_set_and_saved(head, tmp_path):
    for ask, rule in REFUSED:
        with pytest.raises(gazerig.Refused, match=rule):
            ask(head)
    key = "gaze.head.eye_only_range_deg"
    assert head.set({key: 11.0}) == (f"{key} = 11.0",)
    assert head.get(key) == {key: 11.0}
    assert head.save(tmp_path / "mine.yaml").read_text().count("eye_only_range_deg: 11") == 1
    assert head.set({key: 12.0}) and head.revert() == (f"{key} = 11.0",)


def test_people_pixels_and_joints(head):
    (person,) = head.people
    assert set(person.parts_m) >= {"left eye", "mouth"} and person.age_s < 0.2
    assert head.look_at_person(person.id).wait() == "arrived"
    assert head.gaze.target.startswith(f"face {person.id}")
    assert head.look_at_person(99).wait() == "refused"
    assert head.look_at_pixel(200.0, 150.0, distance_m=1.0).wait() == "arrived"
    assert head.jog("neck_yaw", 20.0).wait() == "arrived"
    neck = head.joints["neck_yaw"]
    assert neck.measured_deg == pytest.approx(20.0, abs=1.0) and not neck.estimated
    assert neck.commanded_deg == pytest.approx(20.0, abs=1.0)
    head.release_joints()


def test_face_and_behaviour(head):
    behaviour = head.menus()["behaviour"][-1]
    head.behave(behaviour)
    head.wink("left")
    assert head.run_until(lambda state: state.gaze.lids[1] - state.gaze.lids[0] > 0.4, 0.5)
    nod = head.play("nod")
    assert nod.reply.track is not None and nod.outcome is None
    began_s = head.time_s
    assert nod.wait() == "arrived"
    assert head.time_s - began_s == pytest.approx(nod.reply.track.duration_s, abs=0.02)
    first = head.play("nod")
    second = head.play("nod")
    assert first.wait() == "taken over" and "another track: nod" in first.why
    head.stop("a hand")
    assert second.wait() == "taken over" and second.why == "the torque is switched off"
    head.step(0.1)
    assert head.menus()["behaviour"][0] == behaviour


def test_states_events_and_conditions_step_the_head(head):
    began_s = head.state.t_s
    times = [state.t_s - began_s for state in head.states(rate_hz=10.0, seconds=0.5)]
    assert times == pytest.approx([0.0, 0.1, 0.2, 0.3, 0.4], abs=0.006)
    assert next(head.states(rate_hz=10.0)).t_s >= times[-1]
    for wait in (head.sleep, head.step):
        before_s = head.time_s
        wait(0.25)
        assert head.time_s - before_s == pytest.approx(0.25, abs=0.002)
    assert head.run_until(lambda state: state.gaze.phase == "saccade", 5.0)
    assert not head.run_until(lambda state: state.t_s < 0.0, 0.1)
    head.look_at(1.0, 0.0, 0.3)
    texts = [event.text for event in head.events(timeout_s=0.2)]
    assert "controlled by the program: look at 1 0 0.3" in texts


def test_a_program_is_recorded_and_done_again_to_the_same_bytes(tmp_path):
    """Also with tracks whose files come, change and go meanwhile."""
    tracks, rig = tmp_path / "tracks", at_rate(tmp_path, "desk", 50.0)
    tracks.mkdir()
    file = tmp_path / "program.mcap"
    bow = "description: x\nframes: [{{time_s: 0.5, head_pitch_deg: {}}}]\n"
    options: dict[str, Any] = {"bus": "emulated", "scene": "face-to-face", "record": file}
    with gazerig.open(rig, fast=True, **options) as head:
        head.step(1.0)
        head.look_at_pixel(200.0, 150.0).wait()
        head.play("nod")
        head.look_towards(20.0, 0.0, frame="head", for_s=0.3)
        head.step(0.5)
        head.look_at(1.0, -0.2, 0.1).wait()
        head.look_at_person(head.people[0].id).wait()
        (tracks / "late.yaml").write_text(bow.format(-4))
        head.play("late")
        head.step(0.5)
        first_deg = head.state.joints["neck_pitch"].commanded_deg
        (tracks / "late.yaml").write_text(bow.format(6.5))
        head.step(1.0)
        head.play("late")
        head.step(0.5)
        assert head.state.joints["neck_pitch"].commanded_deg > first_deg + 8.0
        (tracks / "bad.yaml").write_text("description: x\nframes: [{time_s: 1}]\n")
        with pytest.raises(gazerig.Refused, match=r"bad.yaml:2: .*names no motion"):
            head.play("bad")
        cued = bow.format(-4) + "loop: true\ncues: {down: 0.5, up: 0.9, start: 0.0}\n"
        (tracks / "late.yaml").write_text(cued)
        head.play("late", from_s="down")
        head.step(2.0)
        cues = [event.subject for event in head.events(0.0, kinds=("cue",))]
        assert cues == ["down", "up", "start"] * 2
        head.jog("neck_yaw", 10.0)
        head.step(0.5)
    for track in tracks.iterdir():
        track.unlink()
    again = rerun(RunRecording(file))
    assert again.is_same and again.sent_bytes_same and not again.notes


class BadRule:
    """Fails."""

    def choose(self, percept: Percept | None, state: GazeState, t_s: float) -> Vec3:
        raise RuntimeError("out of ideas")


def test_a_head_moves_in_its_block_alone_and_parks_whatever_ends_it(devices):
    said: list[str] = []
    closed = gazerig.open("desk", fast=True, say=said.append)
    with pytest.raises(gazerig.Error, match="in a with block"):
        closed.look_at(1.0, 0.0, 0.0)
    with pytest.raises(ZeroDivisionError), closed as head:
        head.step(0.5)
        raise ZeroDivisionError
    assert said[-1] == "stopped by the program: parked, torque off"
    with pytest.raises(gazerig.HeadEnded, match="the program"):
        head.step()
    with pytest.raises(gazerig.Error, match="open another"), closed:
        pass
    bad = gazerig.open("desk", fast=True, attention=BadRule(), say=said.append)
    with pytest.raises(RuntimeError, match="out of ideas"), bad as head:
        head.step(0.1)
    assert said[-1] == "stopped by the program: parked, torque off"
    dead = gazerig.open("desk", fast=True, bus="emulated", say=said.append)
    with pytest.raises(gazerig.HeadEnded, match="fault: neck_yaw: overload"), dead as head:
        devices[-1].faults.command("overload 7")
        with suppress(gazerig.HeadEnded):
            head.step(1.0)


UNFIT: tuple[tuple[dict[str, Any], type[Exception], str], ...] = (
    ({"rig": "dusk"}, gazerig.ConfigError, "did you mean 'desk'"),
    ({"character": "shyy"}, gazerig.ConfigError, "did you mean 'shy'"),
    ({"scene": "visitr"}, gazerig.ConfigError, "did you mean .visitor."),
    ({"scene": "visitor", "video": "x.avi"}, gazerig.SetupError, "exclude each other"),
    ({"video": "/nowhere.avi"}, gazerig.SetupError, "nowhere.avi"),
)


def test_what_does_not_fit_is_one_line_of_one_family():
    for options, error, words in UNFIT:
        assert issubclass(error, gazerig.Error)
        with pytest.raises(error, match=words), gazerig.open(**{"fast": True, **options}):
            pass
