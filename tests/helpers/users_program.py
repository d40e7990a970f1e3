"""A user's program, checked as strictly as mypy can."""

import gazerig


def follow(head: gazerig.Head, seconds: float) -> str:
    order = head.look_at(1.0, 0.2, 0.3, for_s=seconds)
    outcome: gazerig.Outcome = order.wait(5.0)
    print(order.why)
    for person in head.people:
        head.look_at_person(person.id)
        print(person.parts_m["left eye"])
    for state in head.states(rate_hz=10.0):
        print(state.joints["neck_yaw"].measured_deg, state.gaze.direction_deg)
        break
    for event in head.events(timeout_s=0.0):
        print(event.text)
    head.set({"gaze.head.eye_only_range_deg": 30.0})
    return outcome


def main() -> None:
    try:
        with gazerig.open("desk", mock=True) as head:
            follow(head, 2.0)
        with gazerig.open("desk", fast=True) as simulated:
            simulated.step(1.0)
            simulated.run_until(lambda state: bool(state.people), timeout_s=5.0)
            follow(simulated, 2.0)
        with gazerig.connect() as other:
            follow(other, 2.0)
    except gazerig.Refused as error:
        print(error)
    solved = gazerig.inverse("desk", (1.0, 0.2, 0.3))
    pose: gazerig.HeadPose = gazerig.forward(gazerig.load_rig("desk"), solved.joints_rad)
    print(pose.head_m, solved.reachable, gazerig.__version__)
