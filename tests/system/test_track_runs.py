"""Tracks on whole robots over emulated servos in simulated time: followed by joints and eyes."""

from dataclasses import replace
from math import degrees

import numpy as np
import pytest
from fakes.runs import ticks
from slow_rigs import slowed

from gazerig.config.schema import Rig, load_rig
from gazerig.robot.loop.tick import Tick
from gazerig.robot.model.commands import LookAt, Play
from gazerig.robot.model.kinematics import gaze_error
from gazerig.robot.model.reply import CommandReply
from gazerig.robot.run.run import Run

pytestmark = pytest.mark.usefixtures("ideal_servos")

DT = 0.01
POINT = (1.0, 0.0, 0.25)


def steady(name: str) -> Rig:
    """Return a rig without drift, recentring, and eye turns of blinks."""
    rig = slowed(load_rig(name), 1.0 / DT)
    gaze = rig.gaze
    gaze = replace(
        gaze,
        drift="none",
        head=replace(gaze.head, eye_only_range_deg=0.0),
        lids=replace(gaze.lids, law="nakamoto"),
    )
    return replace(rig, gaze=gaze)


def played(made: Run, track: str) -> tuple[CommandReply, list[Tick]]:
    """Play a track and go on until shortly after its end."""
    ticket = made.robot.command(Play(track))
    first = ticks(made, 1, DT)
    reply = ticket.wait(0.0)
    assert reply is not None and reply.track is not None, reply
    return reply, first + ticks(made, int(reply.track.duration_s / DT) + 30, DT)


OWNED = """\
description: own neck and jaw
owns: [neck, jaw]
frames:
  - {time_s: 1.0, head_yaw_deg: 10, joints_deg: {jaw: 4}}
  - {time_s: 2.0, head_yaw_deg: -8, head_pitch_deg: -5, levels: {mouth: 0.5}}
  - {time_s: 3.0, head_yaw_deg: 0, head_pitch_deg: 0, joints_deg: {jaw: 0}}
"""


def test_what_a_track_owns_is_its_alone_and_gaze_keeps_the_eyes_on_the_point(tmp_path, started):
    file = tmp_path / "own.yaml"
    file.write_text(OWNED, encoding="utf-8")
    rig = replace(steady("expressive"), track_files=(str(file),))
    made = started(rig)
    made.robot.command(LookAt(POINT, stay=True))
    ticks(made, 150, DT)
    _, found = played(made, "own")
    yaw, jaw = rig.names.index("neck_yaw"), rig.names.index("jaw")
    at_s = [tick.t_s - found[0].t_s for tick in found]
    angles = np.degrees([tick.guard_result.command_rad for tick in found])
    at_2s = int(np.searchsorted(at_s, 2.0))
    assert angles[at_2s, yaw] == pytest.approx(-8.0, abs=0.1)
    assert angles[:, jaw].max() > 3.9
    errors = [degrees(gaze_error(POINT, tick.pose)) for tick in found]
    assert max(errors) < errors[0] + 0.7
    assert found[at_2s].tracks[-1].owns == ("neck_yaw", "neck_pitch", "jaw")
    assert found[-1].tracks[-1].end_reason == "finished"
    file = tmp_path / "stare.yaml"
    file.write_text(
        "description: x\nowns: [eyes, lids]\nframes:\n"
        "  - {time_s: 1, eyes_yaw_deg: 10, lids: {all: 0.4}}\n"
        "  - {time_s: 3, eyes_yaw_deg: 10, lids: {all: 0.4}}\n  - {time_s: 4, eyes_yaw_deg: 0}\n"
    )
    desk = replace(slowed(load_rig("desk"), 1.0 / DT), track_files=(str(file),))
    made = started(desk)
    ticks(made, 150, DT)
    _, found = played(made, "stare")
    held = found[120:290]  # saccades and blinks of gaze do not move them
    for eye in (0, 1):
        pans = [(tick.gaze.eye_left_rad, tick.gaze.eye_right_rad)[eye][0] for tick in held]
        assert np.degrees(pans) == pytest.approx(10.0, abs=1e-6)
    assert [tick.gaze.lid_left for tick in held] == pytest.approx([0.4] * len(held), abs=1e-6)
    assert len({tick.gaze.saccades for tick in held}) > 1
    assert found[-1].gaze.eye_left_rad != found[-1].gaze.eye_right_rad  # they converge again
