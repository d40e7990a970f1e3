"""Causes and remedies of depthai's errors at the start of a camera."""

_CURES = (
    (("already_in_use", "already in use"), "another program uses it: end that"),
    (
        ("insufficient_permissions", "permission"),
        "it may not be opened: set up Luxonis' udev rule, and plug it in again",
    ),
    (
        ("after booting", "device_not_found", "no available devices"),
        "it did not come back after it was started: use a USB 3 cable straight at the computer, "
        "not a hub, and give it its power supply",
    ),
    (
        ("out of memory", "not enough", "cannot allocate", "insufficient", "shaves", "cmx"),
        "more is asked than its chip holds: set smaller frames, oak.depth: false or no oak.face_model",
    ),
    (
        ("resolution", "sensor mode", "sensor config", "unsupported size"),
        "its sensor has no frames of that size or rate: set oak.width_px and oak.height_px to "
        "640 x 400, and oak.rate_hz to 30",
    ),
    (("host only",), "its nodes need a camera"),
)
"""Parts of messages, in lower case -> cause and remedy."""
_OTHERWISE = "unplug it, wait a second, plug it in again; if another program uses it, end that"


def start_cure(message: str) -> str:
    """Return the remedy for an error at the start."""
    lower = message.lower()
    for parts, cure in _CURES:
        if any(part in lower for part in parts):
            return cure
    return _OTHERWISE
