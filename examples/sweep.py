"""A sweep without hardware: how fast eyes and head meet a point aside, as a table.

Shows: simulated time, and parameters by their keys; the same seed gives the same figures.
Run:   python examples/sweep.py
"""

from itertools import product

import gazerig

SACCADE_DEG_S = (150.0, 500.0)
HEAD_DEG_S = (30.0, 120.0)


def measure(saccade_deg_s: float, head_deg_s: float) -> tuple[float, float]:
    """Return after how many seconds the gaze is on a point 50 deg aside, and the head at rest."""
    with gazerig.open("desk", fast=True, seed=1) as head:
        head.set(
            {
                "gaze.saccade.max_speed_deg_s": saccade_deg_s,
                "gaze.head.base_speed_deg_s": head_deg_s,
            }
        )
        head.look_at(1.0, 0.0, 0.1)
        head.sleep(2.0)
        start_s = head.time_s
        head.look_towards(50.0, 0.0, distance_m=1.0).wait()
        met_s = head.time_s - start_s
        head.run_until(lambda state: abs(state.joints["neck_yaw"].velocity_rad_s) > 0.1)
        head.run_until(lambda state: abs(state.joints["neck_yaw"].velocity_rad_s) < 0.01)
        return met_s, head.time_s - start_s


if __name__ == "__main__":
    print("saccade deg/s  head deg/s  gaze there s  head there s")
    for saccade_deg_s, head_deg_s in product(SACCADE_DEG_S, HEAD_DEG_S):
        gaze_s, head_s = measure(saccade_deg_s, head_deg_s)
        print(f"{saccade_deg_s:13g}  {head_deg_s:10g}  {gaze_s:12.2f}  {head_s:12.2f}")
