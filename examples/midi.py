"""MIDI: keys of a keyboard or sequencer start tracks; needs pip install mido python-rtmidi.

Shows: orders to a running head from an instrument.
Run:   gazerig run --mock, then python examples/midi.py
"""

import gazerig

TRACKS = {60: "nod", 62: "shake", 64: "laugh"}  # by the number of the key

if __name__ == "__main__":
    try:
        import mido
    except ImportError:
        raise SystemExit("pip install mido python-rtmidi") from None
    with gazerig.connect(who="midi") as head, mido.open_input() as keys:
        for message in keys:
            if message.type == "note_on" and message.velocity and message.note in TRACKS:
                try:
                    print(head.play(TRACKS[message.note]).reply.text())
                except gazerig.Refused as error:  # the head was stopped
                    print(error)
