"""A servo steered at a terminal: keys as they are pressed, lines of a file, and numbers."""

from commands_started import OnTerminal

from gazerig.config.schema import load_rig


def test_keys_steer_a_hobby_servo_at_the_terminal(rigs: dict[str, str]):
    rig = rigs["maker"]
    words = (rig, "--mock", "--yes", "--joint", "eyes_tilt", "--margin", "0")
    with OnTerminal("calibrate", *words) as terminal:
        terminal.reads("shall it begin? [1510]")
        terminal.types(b"\n")
        terminal.reads("straight ahead, then press Enter")
        terminal.reads("1510 us")
        terminal.types(4 * b"\x1b[C")
        terminal.reads("1530 us")
        terminal.types(b"\r")
        terminal.reads("to its UPPER end")
        terminal.types(10 * b"d")
        terminal.reads("1580 us")
        terminal.types(b"\r")
        terminal.reads("eyes_tilt at 1580 us: how many degrees (UPPER is +)?")
        terminal.types(b"8\n")
        terminal.reads("to its LOWER end")
        terminal.types(20 * b"a")
        terminal.reads("1480 us")
        terminal.types(b"\r")
        terminal.reads("at 1480 us: how many degrees")
        terminal.types(b"-7\n")
        # Half-way between each two marks, with the angle that it proposes.
        terminal.reads("eyes_tilt at 1505 us: how many degrees")
        terminal.types(b"-3\n")
        terminal.reads("eyes_tilt at 1555 us: how many degrees")
        terminal.types(b"\n")
        terminal.reads("written into")
    points = load_rig(rig).joints["eyes_tilt"].transmission_points
    assert points == ((-7, 1480), (-3, 1505), (0, 1530), (4, 1555), (8, 1580))
