"""GPIO: a button at a pin of a Raspberry Pi starts a track; needs pip install gpiozero.

Shows: orders to a running head from a switch.
Run:   gazerig run my.yaml, then python examples/gpio.py
"""

import gazerig

PIN, TRACK = 17, "nod"

if __name__ == "__main__":
    try:
        from gpiozero import Button
    except ImportError:
        raise SystemExit("pip install gpiozero") from None
    with gazerig.connect(who="button") as head:
        button = Button(PIN)
        while True:
            button.wait_for_press()
            try:
                print(head.play(TRACK).reply.text())
            except gazerig.Refused as error:  # the head was stopped
                print(error)
            button.wait_for_release()
