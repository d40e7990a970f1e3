"""Prints who is seen, where, and whether the head looks at them.

Shows: the state of a head as an iterator of typed values.
Run:   python examples/people.py            a simulated visitor comes and goes
       python examples/people.py my.yaml 0  your own head, through webcam 0
"""

import sys

import gazerig


def print_people(head: gazerig.Head, seconds: float) -> None:
    """Print the people who are seen, once a second."""
    for state in head.states(rate_hz=1.0, seconds=seconds):
        print(f"the head looks at {state.gaze.target}")
        for person in state.people:
            x, y, z = person.position_m
            print(f"  person {person.id}: {x:.2f} m ahead, {y:+.2f} left, {z:+.2f} up")


if __name__ == "__main__":
    if sys.argv[2:]:
        opened = gazerig.open(sys.argv[1], camera=int(sys.argv[2]))
    else:
        opened = gazerig.open("desk", mock=True, scene="visitor")
    with opened as head:
        print_people(head, seconds=15.0)
