"""Heads in this program."""

from collections.abc import Callable
from pathlib import Path
from typing import Literal, TypedDict, Unpack, overload

from gazerig.config.schema import layers_of
from gazerig.drivers.camera.source import FrameSource
from gazerig.drivers.types import Camera, FaceDetector
from gazerig.local_head import LocalHead, RunningHead, SimulatedHead
from gazerig.robot.loop.chooser import Chooser
from gazerig.robot.recording.body_playback import NoCamera
from gazerig.robot.run.options import RunOptions
from gazerig.robot.run.run import Run
from gazerig.robot.run.run_rig import run_rig


class _Options(TypedDict, total=False):
    """Options of ``open`` for real and for simulated time."""

    mock: bool
    bus: Literal["emulated", "ideal"] | None
    port: str | None
    page: str | None
    token_file: Path | str | None
    scene: str | None
    world: str | None
    video: Path | str | None
    camera: int | str | Camera | FrameSource | None
    oak: bool
    detector: FaceDetector | None
    attention: Chooser | None
    character: str | None
    profile: str | None
    seed: int
    record: Path | str | None
    say: Callable[[str], None] | None


@overload
def open(
    rig: str = "desk", *, fast: Literal[True], **options: Unpack[_Options]
) -> SimulatedHead: ...


@overload
def open(
    rig: str = "desk", *, fast: Literal[False] = False, **options: Unpack[_Options]
) -> RunningHead: ...


def open(
    rig: str = "desk", *, fast: bool = False, mock: bool = False, bus: str | None = None,
    port: str | None = None, page: str | None = None, token_file: Path | str | None = None,
    scene: str | None = None, world: str | None = None, video: Path | str | None = None,
    camera: int | str | Camera | FrameSource | None = None, oak: bool = False,
    detector: FaceDetector | None = None, attention: Chooser | None = None,
    character: str | None = None, profile: str | None = None, seed: int = 0,
    record: Path | str | None = None, say: Callable[[str], None] | None = None,
) -> LocalHead:  # fmt: skip
    """Return a head; its ``with`` block starts it, and parks it and switches it off at the end.

        with gazerig.open("desk", mock=True) as head:
            head.look_at(1.0, 0.2, 0.3).wait()

    With real servos the head looks at the program's targets. With emulated servos it looks at a
    simulated visitor, unless ``camera``, ``oak``, ``video``, ``scene`` or ``world`` is given.

    Args:
        rig: name of a shipped rig, or the path of a YAML file.
        fast: emulated servos in simulated time, stepped by the program (``SimulatedHead.step``).
        mock: emulated servos instead of the rig's.
        bus: replacement of the servos, with ``mock`` or ``fast``: "emulated" (byte for byte, the
            default) or "ideal" (goals in, a lag out, no bytes: faster).
        port: serial port instead of the rig's.
        page: HOST:PORT of the live page; ``say`` receives its address.
        token_file: file with the page's token, as in ``gazerig run --token-file``; None: each start
            makes one.
        scene: simulated people, as in ``gazerig run --scene``.
        world: a world with physics, by name or path, as in ``gazerig run --world``.
        video: a film or image to look at.
        camera: number of a webcam, name of another package's camera, or an object of the program
            that returns frames (``gazerig.drivers.camera.source.FrameSource``) or detections
            (``gazerig.drivers.types.Camera``).
        oak: use an OAK-D camera.
        detector: finds faces in frames (``gazerig.drivers.types.FaceDetector``).
        attention: chooses targets (``gazerig.robot.loop.chooser.Chooser``).
        character: name or path of a character, applied over the rig.
        profile: name or path of a gaze profile.
        seed: seed of all random numbers.
        record: path of the recording.
        say: receives one line per message; None: ``logging.getLogger("gazerig")``.

    Raises:
        ConfigError: there is no such rig, profile or character. Faults in it, and errors of its
            servos (``SetupError``), are raised at the start of the block.
        Error: the options do not fit together.
    """
    layers_of(rig, character, profile)
    own = camera if not isinstance(camera, int | str) else None
    seen = camera if isinstance(camera, int | str) else None
    sees = any(one is not None for one in (scene, world, video, seen)) or oak
    mock = mock or fast
    drawn = scene is not None or (mock and not sees and own is None)
    options = RunOptions(
        rig=rig, mock=mock, fast=fast, bus=bus, port=port, page=page, token_file=_path(token_file),
        scene=scene, world=world, video=_path(video),
        camera=seen, oak=oak, pixels=detector is not None and drawn,
        character=character, profile=profile, seed=seed, record=_path(record), seconds=_FOR_EVER_S,
    )  # fmt: skip
    blind = own is None and not sees and not mock
    options = options.check_and_complete(blind=blind or own is not None)
    view = NoCamera() if blind else own

    def make() -> Run:
        rig = run_rig(options)
        return Run(rig, options, camera=view, detector=detector, rule=attention)

    kind: type[LocalHead] = SimulatedHead if fast else RunningHead
    return kind(options.rig, make, say)


_FOR_EVER_S = 1e9
"""Duration of a scene in simulated time, seconds; otherwise it would end after one round."""


def _path(given: Path | str | None) -> Path | None:
    return None if given is None else Path(given)
