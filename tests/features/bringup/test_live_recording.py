"""Puppeteering: a track of some joints of a running head, while a track plays on others."""

import numpy as np
import pytest

import gazerig
from gazerig.config.load import shipped_path
from gazerig.config.schema import load_rig
from gazerig.config.tracks import load_track
from gazerig.features.bringup.hand_recording import record_live
from gazerig.robot.loop.head_state import HeadState
from gazerig.robot.run.track_file import write_track

TURN = """description: the neck turns
owns: [neck]
frames:
  - {time_s: 1.5, head_yaw_deg: 20}
  - {time_s: 3.0, head_yaw_deg: -15}
"""


class SteppedClock:
    """The head's clock: waiting steps the head, and a puppeteer moves the jaw on the way."""

    def __init__(self, head: gazerig.SimulatedHead) -> None:
        self.head = head
        self.stop_at_s = np.inf

    def now_s(self) -> float:
        return self.head.state.t_s

    def sleep_until(self, t_s: float) -> None:
        while self.now_s() < t_s:
            if self.now_s() >= self.stop_at_s:
                self.head.stop("a hand is near")
                self.stop_at_s = np.inf
            if not self.head.state.stopped:
                self.head.level("mouth", 0.5 + 0.5 * np.sin(3.0 * self.now_s()))
            self.head.step(0.01)


def test_a_puppeteered_jaw_becomes_a_track_of_its_own(tmp_path):
    rig_file = tmp_path / "rig.yaml"
    (tmp_path / "turn.yaml").write_text(TURN)
    rig_file.write_text(
        shipped_path("rigs", "expressive").read_text() + "\ntrack_files: [turn.yaml]\n"
    )
    rig = load_rig(str(rig_file))
    with gazerig.open(str(rig_file), fast=True) as head:
        head.step(3.0)
        order = head.play("turn")
        assert order.reply.track is not None
        head.step(0.05)
        clock = SteppedClock(head)
        seen: list[HeadState] = []

        def read() -> HeadState:
            seen.append(head.state)
            return head.state

        found = record_live(read, ["jaw"], clock, lambda: None, 60.0)
    assert found.ended_by.startswith("turn: ") and set(found.series) == {"jaw"}
    seen = seen[1:]
    times, angles = found.series["jaw"]
    commanded = np.degrees([state.joints["jaw"].commanded_rad for state in seen])
    assert np.ptp(angles) > 5.0 and len(times) > 100
    assert angles == pytest.approx(commanded[: len(angles)])
    path = tmp_path / "mouth.yaml"
    write_track(rig, path, found.series, "puppeteered", owned=True)
    track = load_track(path)
    assert track.owns == ("jaw",)
