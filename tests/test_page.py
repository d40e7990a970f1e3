"""The page takes snapshots without ever holding up its caller, and shows a head that looks."""

import itertools
import math
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import TypeVar

import cv2
import numpy as np
from browser import Browser, browsing
from desk import GAZE_JOINTS
from page_person import Person
from present import present
from shown_page import running_page, wait_for
from six_joints import of_six

from gazerig.gaze.types import PART_NAMES, PARTS
from gazerig.robot.dashboard.feed.camera_overlay import encode
from gazerig.robot.dashboard.feed.page_process import PageProcess, decode_snapshot, encode_snapshot
from gazerig.robot.model.types import SeenBody, SeenFace, Snapshot

T = TypeVar("T")
WINDOW_SMALL_PX = (900, 500)  # a processor that does a graphics card's work has less to do
PANEL_PX = 370
CLOSE_TO_THE_RIG = "initialCameraPosition=0.45,-0.3,0.2&initialCameraLookAt=0,0,0.12"

# A person's face in its own frame (x out of the face, y to the owner's left, z up), in the
# order chin, left side, left eye, mouth, nose, right side, right eye, forehead.
PARTS_M = np.array(
    [
        (-0.015, 0.0, -0.085),
        (-0.045, 0.062, -0.020),
        (-0.022, 0.031, 0.035),
        (-0.010, 0.0, -0.045),
        (0.0, 0.0, 0.0),
        (-0.045, -0.062, -0.020),
        (-0.022, -0.031, 0.035),
        (-0.020, 0.0, 0.080),
    ]
)
LEFT_EYE = 2
PICTURE = np.full((200, 320, 3), (140, 120, 100), np.uint8)


def turned_left(angle_rad: float) -> np.ndarray:
    c, s = math.cos(angle_rad), math.sin(angle_rad)
    return np.array(((c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0)))


def rows(array: np.ndarray) -> tuple:
    return tuple(rows(row) if row.ndim else float(row) for row in array)


def face_at(p_world_m: tuple[float, float, float], id: int = 3) -> SeenFace:
    """A face that looks back along the x axis, a little aside."""
    R_world_face = turned_left(math.pi + 0.2)
    parts_m = np.array(p_world_m) + PARTS_M @ R_world_face.T
    return SeenFace(id, p_world_m, rows(R_world_face), rows(parts_m))


def looking(
    t_s: float = 0.0,
    face: SeenFace | None = None,
    part: int = LEFT_EYE,
    lids: tuple[float, float] = (0.8, 0.8),
    bodies: tuple[SeenBody, ...] = (),
) -> Snapshot:
    """A snapshot of a head that looks at a part of a face; the neck takes a share of the angle."""
    face = face_at((0.9, 0.1, 0.25)) if face is None else face
    target = np.array(face.parts_world_m[part])
    head_yaw = 0.6 * math.atan2(target[1], target[0])
    R_world_head = turned_left(head_yaw)
    p_head = R_world_head @ (0.03, 0.0, 0.14)
    eyes = [p_head + R_world_head @ (0.0, y, 0.0) for y in (0.031, -0.031)]
    gaze = [(target - eye) / np.linalg.norm(target - eye) for eye in eyes]
    in_head = [R_world_head.T @ g for g in gaze]
    angles = [(math.atan2(g[1], g[0]), math.asin(g[2])) for g in in_head]
    joints = (*angles[0], *angles[1], *lids, head_yaw, 0.0, 0.0)
    return Snapshot(
        t_s=t_s,
        measured_rad=joints,
        desired_rad=joints,
        R_world_head=rows(R_world_head),
        p_world_head_m=rows(p_head),
        p_world_eyes_m=(rows(eyes[0]), rows(eyes[1])),
        gaze_world=(rows(gaze[0]), rows(gaze[1])),
        lids=lids,
        p_world_target_m=rows(target),
        target_name=f"face {face.id}: {PART_NAMES[PARTS[part]]}",
        why="a face in view: the rule 'person' pulls with 0.80",
        phase="fixate",
        level="ok",
        reasons=(),
        faces=(face,),
        bodies=(SeenBody(face.id, "face", face.p_world_m, 0.1), *bodies),
        rate_hz=200.0,
        health="bus: 61 200 reads, 3 lost, 0 faults",
        joints=GAZE_JOINTS,
    )


@contextmanager
def feeding(page: PageProcess, source: Callable[[float], Snapshot]) -> Iterator[None]:
    """Feed the page from a thread, as a running rig does."""
    done = threading.Event()
    jpeg = encode(PICTURE)

    def feed() -> None:
        for tick in itertools.count():
            page.show(source(0.01 * tick))
            if tick % 5 == 0:
                page.show_frame(jpeg)
            if done.wait(0.01):
                return

    thread = threading.Thread(target=feed)
    thread.start()
    try:
        yield
    finally:
        done.set()
        thread.join()


# --- what goes over and what a person sees ---------------------------------------------


def test_snapshot_survives_the_way() -> None:
    snapshot = looking(1.5, bodies=(SeenBody(7, "hand", (0.6, 0.3, 0.1), 0.04),))
    assert decode_snapshot(encode_snapshot(snapshot)) == snapshot
    numpys = replace(snapshot, rate_hz=np.float64(99.5), lids=tuple(np.array((0.25, 0.5))))
    assert decode_snapshot(encode_snapshot(numpys)) == numpys


def irises(browser: Browser) -> np.ndarray:
    """Pixels (n, 2) of the rig's blue irises, the only strong blue left of the panel."""
    png = np.frombuffer(browser.photograph(), np.uint8)
    scene = present(cv2.imdecode(png, cv2.IMREAD_COLOR))[:, : browser.width_px - PANEL_PX].astype(
        int
    )
    blue, green, red = scene[..., 0], scene[..., 1], scene[..., 2]
    return np.argwhere((blue > red + 70) & (blue > green + 20))


def test_page_shows_a_head_that_turns() -> None:
    def eyes() -> np.ndarray | None:
        seen = irises(browser)
        return seen if len(seen) > 30 else None

    def eyes_elsewhere() -> bool:
        seen = eyes()
        return seen is not None and bool(np.linalg.norm(seen.mean(axis=0) - before) > 4.0)

    def reads(*said: str) -> bool:
        words = browser.words()
        return all(word in words for word in said)

    with browsing(WINDOW_SMALL_PX) as browser, running_page() as (page, url):
        # All is sent before the browser comes: who is late sees the whole scene.
        page.show(looking(1.0, face_at((0.9, -0.2, 0.25))))
        page.show_frame(encode(PICTURE))
        browser.go(url)
        wait_for(lambda: reads("STOP"), "the page")
        browser.run(f"document.querySelector('#view').src = '/view/?{CLOSE_TO_THE_RIG}'")
        Person(browser).open("Watch")
        wait_for(lambda: reads("the rig has sent nothing"), "the silence")
        shown = "document.querySelector('[data-panel=camera] img').naturalWidth"
        camera = browser.ask("Runtime.evaluate", expression=shown)["result"]
        assert camera.get("value") == PICTURE.shape[1]
        before = wait_for(eyes, "the rig's eyes").mean(axis=0)
        there = looking(2.0, face_at((0.9, 0.6, 0.25)))
        with feeding(page, lambda _: there):
            wait_for(eyes_elsewhere, "the turn of the head")
            wait_for(lambda: reads("face 3: left eye", "pulls with", "fixate"), "the words")
            Person(browser).open("Health")
            wait_for(lambda: reads("bus:", "guard: ok"), "the health")
        # Six servos without feedback: a person is informed before torque is switched on again.
        limp = replace(of_six(there), stopped="a test")
        with feeding(page, lambda t_s: replace(limp, t_s=3.0 + t_s)):
            wait_for(lambda: reads("6 of 6 joints without feedback", "Resume"), "the other rig")
            browser.run("document.querySelector('#rig-words button').click()")
            wait_for(lambda: reads("6 joints without feedback jump to their places"), "the warning")
        here = url.partition("?")[0]
        own = (here, here.replace("http", "ws", 1), "data:", f"blob:{here}")
        assert [asked for asked in browser.asked_for if not asked.startswith(own)] == []
        assert any(asked.startswith(here) for asked in browser.asked_for)
