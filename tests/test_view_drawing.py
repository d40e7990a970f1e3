"""Without a graphics card the view draws only what has moved; the picture is that of all of it."""

import base64
from typing import Any, cast

import cv2
import numpy as np
import pytest
from browser import SLOW_DRAWING, browsing
from page_person import TICK_S, Person, running
from present import present
from shown_page import wait_for

from gazerig.robot.model.commands import LookAt

COUNTED = f"""{SLOW_DRAWING};
window.parts = 0; window.wholes = 0;
const clear = WebGL2RenderingContext.prototype.clear;
WebGL2RenderingContext.prototype.clear = function (mask) {{
  if (this.getParameter(this.FRAMEBUFFER_BINDING) === null && this.canvas.dataset.engine) {{
    if (this.isEnabled(this.SCISSOR_TEST)) window.parts += 1; else window.wholes += 1;
  }}
  clear.call(this, mask);
}};
"""
VIEW = "document.querySelector('#view')?.contentWindow?"
CANVAS = f"{VIEW}.document.querySelector('canvas[data-engine]')"


def drawings(person: Person) -> tuple[int, int]:
    """Numbers of pictures that drew a part, and all."""
    parts, wholes = cast(Any, person.run(f"[{VIEW}.parts ?? 0, {VIEW}.wholes ?? 0]"))
    return int(parts), int(wholes)


def picture(person: Person) -> "np.ndarray[Any, Any]":
    png = str(person.run(f"{CANVAS}.toDataURL('image/png')")).partition(",")[2]
    found = cv2.imdecode(np.frombuffer(base64.b64decode(png), np.uint8), cv2.IMREAD_COLOR)
    return present(found).astype(int)


def test_a_picture_of_parts_is_the_picture_of_the_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    with browsing((800, 600), COUNTED) as tab, running() as (rig, url):
        tab.go(url)
        person = Person(tab)
        wait_for(lambda: drawings(person)[0] > 20, "pictures of parts")
        rig.pace_s = TICK_S  # in real time, so that eyes and head jump from picture to picture
        for turn in range(50):
            before = drawings(person)
            wait_for(lambda: drawings(person)[1] > before[1], "a picture of all")  # noqa: B023
            begin = drawings(person)
            rig.robot.command(LookAt((0.5, 0.5 * (-1) ** turn, 0.2), stay=True))
            wait_for(lambda: drawings(person)[0] > begin[0] + 5, "parts that move")  # noqa: B023
            with monkeypatch.context() as patch:
                patch.setattr(rig.audience, "update", lambda tick: None)
                person.wait_for_frames(3)  # what was sent before has come
                count, of_parts, again = drawings(person), picture(person), drawings(person)
                if count == again and count[1] == begin[1]:
                    wait_for(lambda: drawings(person)[1] > count[1], "a picture of all")  # noqa: B023
                    whole = picture(person)
                    break
        else:
            pytest.fail("no picture of parts stayed until it was looked at")
        assert np.ptp(whole) > 100 and whole.shape == of_parts.shape
        differs = np.abs(whole - of_parts).max(axis=2) > 24
        # A motion below .3 pixels is not drawn until all is: it changes only edges.
        assert differs.mean() < 0.001
