"""The emulated servos that clients of others are let loose on."""

BAUD = 1_000_000
IDS = (1, 2, 3)
PLACES = (2048, 1000, 3000)
SPECS = [(i, "xl330-m288", place) for i, place in zip(IDS, PLACES, strict=True)]
X430 = [(11, "xl430-w250", 1024), (12, "xm430-w350", 2048)]
