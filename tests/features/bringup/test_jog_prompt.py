"""A servo steered at a terminal: keys as they are pressed, lines of a file, and numbers."""

from commands_started import OnTerminal

from gazerig.config.schema import load_rig

DIALOGUE = r"""
shall it begin? [1510] | \n
straight ahead, then press Enter |
1510 us | \x1b[C\x1b[C\x1b[C\x1b[C
1530 us | \r
to its UPPER end | dddddddddd
1580 us | \r
eyes_tilt at 1580 us: how many degrees (UPPER is +)? | 8\n
to its LOWER end | aaaaaaaaaaaaaaaaaaaa
1480 us | \r
at 1480 us: how many degrees | -7\n
eyes_tilt at 1505 us: how many degrees | -3\n
eyes_tilt at 1555 us: how many degrees | \n
written into |
"""
"""What is read and what is then typed; at last half-way between each two marks."""


def test_keys_steer_a_hobby_servo_at_the_terminal(rigs):
    rig = rigs["maker"]
    words = (rig, "--mock", "--yes", "--joint", "eyes_tilt", "--margin", "0")
    with OnTerminal("calibrate", *words) as terminal:
        for line in DIALOGUE.strip().splitlines():
            said, _, keys = line.partition(" |")
            terminal.reads(said)
            terminal.types(keys.strip().encode().decode("unicode_escape").encode())
    points = load_rig(rig).joints["eyes_tilt"].transmission_points
    assert points == ((-7, 1480), (-3, 1505), (0, 1530), (4, 1555), (8, 1580))
