"""Balance of attention: how much of the time outside saccades is spent on faces that are there.

The time in which a frontal face within 1.5 m is there, and the share of it in which the measured
gaze is on a face, that one or another. Looks away from a face, which end mutual gaze after some
seconds as people do, are left out.
"""

from collections.abc import Callable
from dataclasses import replace
from math import acos, atan, degrees, radians

from seeing.material import carphone

from gazerig.config.schema import load_rig
from gazerig.gaze.angles import add, dot, norm, scale, sub, unit
from gazerig.gaze.types import Face, Vec3
from gazerig.robot.loop.loop import run
from gazerig.robot.loop.tick import Tick, cyclopean_direction
from gazerig.robot.run.options import RunOptions
from gazerig.robot.run.run import Run

NEAR_M, FRONTAL_RAD = 1.5, radians(45.0)
BESIDE_DEG, FACE_M = 3.0, 0.09
TALK_SEEDS = (0, 1, 2, 3, 4)

WANTED = {
    "talks in a car, % on the face": (75.0, 100.0),
    "rendered conversation, % on a face": (85.0, 100.0),
    "conversation, worst seed, %": (80.0, 100.0),
}


def _beside_deg(tick: Tick, eye: Vec3, face: Face) -> float:
    way = sub(face.p_world_m, eye)
    off = acos(max(-1.0, min(1.0, dot(cyclopean_direction(tick), unit(way)))))
    return degrees(off - atan(FACE_M / norm(way)))


def percent_on_faces(options: RunOptions) -> float:
    """Run the shipped desk rig; return how much of the time was spent on present faces, in %."""
    rig = load_rig(options.rig)
    made = Run(replace(rig, loop=replace(rig.loop, rate_hz=100.0)), options)
    there = on_face = 0

    def count(tick: Tick) -> None:
        nonlocal there, on_face
        if tick.gaze.phase == "saccade" or tick.percept is None or tick.target.kind == "away":
            return
        left, right = tick.pose.p_world_eye_left_m, tick.pose.p_world_eye_right_m
        eye = scale(add(left, right), 0.5)
        faces = tick.percept.faces
        if any(
            norm(sub(face.p_world_m, eye)) < NEAR_M and (face.off_head_rad or 0.0) < FRONTAL_RAD
            for face in faces
        ):
            there += 1
            on_face += any(_beside_deg(tick, eye, face) <= BESIDE_DEG for face in faces)

    made.robot.start(made.clock)
    try:
        run(made.robot, made.clock, made.loop, _ends_after(options.seconds), count)
    finally:
        made.robot.stop()
        made.close()
    return 100.0 * on_face / max(1, there)


def _ends_after(seconds: float | None) -> Callable[[float], str | None]:
    return lambda now_s: "seconds" if seconds is not None and now_s >= seconds else None


def measure(full: bool) -> dict[str, float]:
    """Return the figures of a film and of a rendered conversation; full: with five seeds."""
    talk = RunOptions(True, True, seed=0, bus="ideal", video=carphone(), seconds=8.0)
    seen = [
        percent_on_faces(
            RunOptions(True, True, seed=seed, bus="ideal", world="conversation",
                       seconds=24.0 if full else 8.0)
        )
        for seed in (TALK_SEEDS if full else TALK_SEEDS[:1])
    ]  # fmt: skip
    return {
        "talks in a car, % on the face": percent_on_faces(talk),
        "rendered conversation, % on a face": sum(seen) / len(seen),
        "conversation, worst seed, %": min(seen),
    }
