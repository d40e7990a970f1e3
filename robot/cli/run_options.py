"""Options of the command run, with their help."""

from pathlib import Path
from typing import Annotated

import typer

from gazerig.robot.cli.examples import complete_shipped, complete_world

Name = Annotated[
    str | None,
    typer.Option(help="Name of this head, for gazerig ctl --rig NAME; default: that of its file."),
]
Mock = Annotated[bool, typer.Option(help="Emulated servo bus instead of the rig's.")]
Port = Annotated[str | None, typer.Option(help="Serial port instead of the rig's.")]
Scene = Annotated[
    str | None,
    typer.Option(
        metavar="NAME|FILE",
        help="Look at a simulated scene (default with --mock: visitor), or your own script.",
        autocompletion=complete_shipped("scenes"),
    ),
]
World = Annotated[
    str | None,
    typer.Option(
        metavar="NAME|FILE",
        help="Place the rig in a world with physics, seen through a rendered camera (needs --mock): "
        "living-room, boxing, conversation, crowd, or your own file (YAML, MJCF).",
        autocompletion=complete_world,
    ),
]
Rate = Annotated[
    float | None,
    typer.Option(min=20.0, max=1000.0, metavar="HZ", help="Rate of the loop instead of the rig's."),
]
Computer = Annotated[
    str | None,
    typer.Option(
        metavar="LEVEL",
        help="Power of this computer: full, small, busy or least. `make run` measures it; "
        "--rate and --world override it.",
    ),
]
NoPictures = Annotated[
    bool,
    typer.Option(
        "--no-pictures",
        help="Render no images of the world: detections are computed, as in a scene.",
    ),
]
Video = Annotated[Path | None, typer.Option(help="Look at a film or an image, in a loop.")]
Camera = Annotated[
    str | None,
    typer.Option(
        metavar="N", help="Look through webcam N, or through the camera NAME of a package."
    ),
]
Oak = Annotated[bool, typer.Option(help="Look through an OAK-D camera.")]
Replay = Annotated[
    Path | None,
    typer.Option("--camera-recording", help="Look at a recording of --record-camera, in a loop."),
]
RecordCamera = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE", help="Record every frame of the camera: FILE.mcap, or FILE-2 if it exists."
    ),
]
Pixels = Annotated[
    bool, typer.Option(help="Draw the scene, and detect faces and motion in the frames.")
]
Seconds = Annotated[float | None, typer.Option(min=0.0, help="Stop after S seconds.")]
Seed = Annotated[int, typer.Option(min=0, help="Seed of all random numbers.")]
Fast = Annotated[bool, typer.Option(help="Simulated time: run as fast as possible (needs --mock).")]
Bus = Annotated[
    str | None,
    typer.Option(
        help="Substitute for the servos: emulated (byte for byte, default with --mock) or ideal "
        "(goals in, a lag out: twice as fast)."
    ),
]
Profile = Annotated[
    str | None,
    typer.Option(
        help="Style of gaze: robot, or literal mitake, nakamoto.",
        autocompletion=complete_shipped("profiles"),
    ),
]
Character = Annotated[
    str | None,
    typer.Option(
        help="A character applied over the rig, instead of its own: shy, bold, sleepy ...; none.",
        autocompletion=complete_shipped("characters"),
    ),
]
Rules = Annotated[
    str | None,
    typer.Option(
        help="Rule set instead of the rig's: boxing, conversation.",
        autocompletion=complete_shipped("rules"),
    ),
]
Behaviour = Annotated[str | None, typer.Option(help="Initial behaviour, one of the rig's rules.")]
Conversation = Annotated[
    str | None,
    typer.Option(help="Gaze aversion as in a conversation: talk, listen, think; none (default)."),
]
Scanpath = Annotated[
    str | None, typer.Option(help="Face scanpath: markov, simple, face_tracking, random.")
]
Saccade = Annotated[str | None, typer.Option(help="Saccades: human, min_jerk, literal_frame.")]
Page = Annotated[
    str,
    typer.Option(
        metavar="HOST:PORT",
        help="HOST:PORT of the live page; 0.0.0.0:8080 serves other computers too. It "
        "needs the token in the address that is printed at the start.",
    ),
]
TokenFile = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE",
        help="File with the page's token, which stays the same; created if it does not exist.",
    ),
]
NoPage = Annotated[bool, typer.Option("--no-page", help="Do not serve the live page.")]
NoBrowser = Annotated[
    bool,
    typer.Option("--no-browser", help="Do not open the page in a browser."),
]
Verbose = Annotated[
    bool,
    typer.Option(
        "--verbose", help="Also print which registers are set and which tables are adjusted."
    ),
]
Record = Annotated[
    Path | None, typer.Option(help="Record every tick, for reruns and reports: FILE.mcap.")
]
RecordPictures = Annotated[
    float, typer.Option(min=0.0, max=60.0, help="Camera frames per second in the recording.")
]
Force = Annotated[
    bool,
    typer.Option("--force", help="Overwrite an existing recording or summary."),
]
Recover = Annotated[
    bool,
    typer.Option(
        "--recover",
        help="Move a joint that is more than 10 deg outside its range slowly inside, at 30 deg/s at "
        "most; without this option the torque stays off.",
    ),
]
Summary = Annotated[
    str | None, typer.Option(help="Write figures as JSON to this file; - prints them.")
]
