"""Saccades that each servo model can make, as Markdown: python tests/lab/bench_saccades.py

The servo turns an eye directly and gets the goals of the model of human saccades at 200 Hz, with
the gains of a shipped rig and with those of its maker. Times until it stays within 1 deg.
"""

from dataclasses import replace

from gazerig.config.rig import Rig
from gazerig.config.schema import load_rig
from gazerig.drivers.bus.servo_models import SERVOS
from gazerig.features.lab.report.servo_saccades import AMPLITUDES_DEG, saccade_times
from gazerig.robot.model.joint import JointParams

TUNED: dict[str, tuple[tuple[int, int, int], str]] = {
    "xl330-m077": ((1200, 0, 12000), "desk"),
    "xc330-m288": ((2000, 0, 14000), "desk"),
    "sts3215": ((48, 0, 64), "feetech"),
}
"""Gains of shipped rigs."""
RIGS = {"dynamixel": "minimal", "feetech": "feetech", "maestro": "six_hobby"}
FAST_DEG_S, HARD_DEG_S2 = 2000.0, 200_000.0


def eye_rig(model: str, gains: tuple[int, int, int] | None) -> Rig:
    """Return a rig whose eye servo of a model turns the eye directly."""
    rig = load_rig(RIGS[SERVOS[model].bus])
    joint = JointParams(
        1, model, -35.0, 35.0, FAST_DEG_S, HARD_DEG_S2, gains=gains,
        servo_speed_deg_s=600.0 if model == "hobby" else None,
    )  # fmt: skip
    human = replace(rig.gaze.saccade, profile="human", max_speed_deg_s=1000.0)
    gaze = replace(rig.gaze, saccade=replace(human, max_acceleration_deg_s2=100_000.0))
    return replace(rig, joints={"eyes_pan": joint}, couplings={}, gaze=gaze)


def main() -> None:
    """Measure, and print."""
    heads = " | ".join(f"{one:g} deg, ms" for one in AMPLITUDES_DEG)
    print(f"| servo | gains P, I, D | {heads} |\n|--|--|{'--|' * len(AMPLITUDES_DEG)}")
    people = saccade_times(eye_rig("xl330-m077", None), "eyes_pan")
    print(f"| people | | {' | '.join(str(one.model_ms) for one in people)} |")
    for model in SERVOS:
        choices: list[tuple[tuple[int, int, int] | None, str]] = [
            (None, "" if model == "hobby" else "the maker's")
        ]
        if model in TUNED:
            gains, rig = TUNED[model]
            choices.append((gains, f"{', '.join(map(str, gains))} ({rig})"))
        for own, name in choices:
            times = saccade_times(eye_rig(model, own), "eyes_pan")
            shown = ("more than 1200" if one.servo_ms is None else one.servo_ms for one in times)
            print(f"| {model} | {name} | {' | '.join(map(str, shown))} |", flush=True)


if __name__ == "__main__":
    main()
