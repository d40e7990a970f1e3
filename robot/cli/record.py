"""Command record-camera: frames of a camera in a file, as input of later runs."""

import sys
import threading
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gazerig.drivers.camera.params import WebcamParams
from gazerig.drivers.errors import SetupError
from gazerig.robot.cli.terminal import clear_errors, record_signals, say, status
from gazerig.robot.model.clock import RealClock

if TYPE_CHECKING:
    from gazerig.drivers.camera.source import FrameSource

app = typer.Typer(add_completion=False)

_NEVER = threading.Event()  # frames come often enough to check for Ctrl-C between them


@app.command("record-camera")
def record_camera(
    file: Annotated[Path, typer.Argument(help="File to write, usually .mcap.")],
    oak: Annotated[bool, typer.Option(help="Record an OAK-D: colour, depth, lens.")] = False,
    camera: Annotated[int | None, typer.Option(help="Record webcam N.")] = None,
    video: Annotated[Path | None, typer.Option(help="Record a film like a camera.")] = None,
    seconds: Annotated[
        float | None, typer.Option(min=0.0, help="Stop after S seconds; otherwise at Ctrl-C.")
    ] = None,
    width: Annotated[int, typer.Option(min=16, help="Requested width.")] = 640,
    height: Annotated[
        int | None, typer.Option(min=16, help="Height (default: 400 for --oak, otherwise 480).")
    ] = None,
    rate: Annotated[float, typer.Option(min=1.0, help="Requested frames per second.")] = 30.0,
    jpeg: Annotated[
        int | None,
        typer.Option(min=1, max=100, help="JPEG of this quality; default: PNG, which is exact."),
    ] = None,
    force: Annotated[bool, typer.Option(help="Overwrite an existing file.")] = False,
) -> None:
    """Record the frames of a camera, for gazerig run --camera-recording FILE."""
    with clear_errors():
        source, name = _source(oak, camera, video, (width, height, rate))
        with record_signals() as stopped:
            _record(source, name, file, seconds, jpeg, force, stopped)


def _source(
    oak: bool, camera: int | None, video: Path | None, requested: tuple[int, int | None, float]
) -> tuple["FrameSource", str]:
    """Return the one source that was chosen, and its name."""
    asked = [n for n, v in (("oak", oak), ("camera", camera is not None), ("video", video)) if v]
    if len(asked) != 1:
        raise SetupError(
            f"record-camera takes one of --oak, --camera N and --video FILE, not {len(asked)}"
        )
    width, height, rate_hz = requested
    # OpenCV and depthai are large: imported only when they are needed.
    if oak:
        from gazerig.drivers.camera.oak.params import OakParams
        from gazerig.drivers.camera.oak.source import OakSource

        params = OakParams(width_px=width, height_px=height or 400, rate_hz=rate_hz)
        return OakSource(params), "OAK-D"
    if video is not None:
        from gazerig.drivers.camera.video_file import VideoFile

        return VideoFile(video), f"film {video.name}"
    from gazerig.drivers.camera.webcam import Webcam

    wanted = WebcamParams(width_px=width, height_px=height or 480, rate_hz=rate_hz)
    return Webcam(camera or 0, wanted), f"webcam {camera}"


def _record(
    source: "FrameSource",
    name: str,
    file: Path,
    seconds: float | None,
    jpeg: int | None,
    force: bool,
    stopped: Callable[[], str | None],
) -> None:
    """Record until stopped, and print the content of the file."""
    from gazerig.drivers.camera.recorder import CameraRecorder

    clock = RealClock()
    recorder = CameraRecorder(source, file, {"source": name}, jpeg, force)
    recorder.open()
    began_s = clock.now_s()
    try:
        while stopped() is None and not recorder.failure:
            past_s = clock.now_s() - began_s
            if seconds is not None and past_s >= seconds:
                break
            shot = recorder.take(clock.now_s, _NEVER)
            for line in recorder.events():
                say(line)
            depth = "with depth" if shot is not None and shot.depth_m is not None else "no depth"
            if sys.stderr.isatty():
                status(f"{past_s:7.1f} s  {recorder.written_frames} frames, {depth}: Ctrl-C stops")
    finally:
        recorder.close()
        recorder.finish()
        size_mb = file.stat().st_size / 1e6
        left = f", {recorder.dropped_frames} omitted" if recorder.dropped_frames else ""
        say(f"{recorder.written_frames} frames ({size_mb:.1f} MB{left}) in {file}")
    if recorder.failure:
        raise SetupError(recorder.failure)
