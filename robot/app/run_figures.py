"""Figures of a run: ticks, loop, images, scene and bus."""

from typing import NamedTuple

from gazerig.robot.analysis.behaviour_score import BehaviourScore
from gazerig.robot.analysis.planner_score import PlannerScore
from gazerig.robot.analysis.summary import Summary
from gazerig.robot.app.assemble import Assembly
from gazerig.robot.control.joint_faults import JointFaults
from gazerig.robot.control.loop import LoopCount
from gazerig.sim_mock.scenes.scene import Scene


class SceneScore(NamedTuple):
    """Score of the responses to a scene's events, by the gaze and by the action planner."""

    behaviours: BehaviourScore
    planner: PlannerScore

    @classmethod
    def of(cls, scene: Scene) -> "SceneScore":
        """Return the score of a scene before its first tick."""
        events = scene.events()
        return cls(BehaviourScore(events, scene.round_s), PlannerScore(events, scene.round_s))


def run_figures(
    made: Assembly,
    summary: Summary | None,
    score: SceneScore | None,
    count: LoopCount,
    wall_s: float,
    faults: JointFaults,
) -> dict[str, object]:
    """Join the figures of the ticks (if summarised), the loop, the frames and the bus."""
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
    ticks = summary.figures() if summary is not None else {}
    if score is not None and (behaviours := score.behaviours.figures()):
        ticks["behaviours"] = behaviours
    if score is not None and (planner := score.planner.figures()):
        ticks["planner"] = planner
    seconds = {"seconds": ticks.pop("seconds")} if ticks else {}
    return {
        **seconds,
        "wall_seconds": round(wall_s, 3),
        "ticks": count.ticks,
        "overruns": count.overruns,
        "faces_seen": robot.perception.frames_with_face,
        "pictures": robot.perception.frames,
        "head_turn_residual": robot.perception.residual()._asdict(),
        **ticks,
        "joint_faults": faults.figures(),
        "bus": bus,
        "stopped_by": count.stopped_by,
    }
