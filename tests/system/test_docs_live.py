"""Commands of README and docs that need a head that runs, servos, or a recording."""

import json
import re
import shlex
import signal
import subprocess
from collections.abc import Iterator
from pathlib import Path
from shutil import which
from xml.etree import ElementTree

import pytest
from branch import Branch
from branch import gazerig as gazerig_branch
from command_line import invoked
from features_there import needs_all_features
from mcap.reader import make_reader
from papers import COMMANDS, blocks
from shown_page import wait_for

import gazerig
from gazerig.config.load import shipped_path
from gazerig.drivers.sound.sound_file import write_wav
from gazerig.robot.loop import body

pytestmark = [needs_all_features, pytest.mark.usefixtures("simulated_wires")]

SAYS_TEXT = re.compile(r"ctl say (?!\S+\.wav)")
TO_A_HEAD = [
    w
    for w in COMMANDS
    if re.match(r"(ctl|stop)\b", w)
    and " fault " not in w
    and (which("espeak-ng") or not SAYS_TEXT.match(w))
]
TO_SERVOS = [
    w
    for w in COMMANDS
    if re.match(r"(jog|look-at|home|monitor|reboot|doctor|scan)\b", w)
    and not re.search(r"--mock|--port|myhead", w)
]
ON_A_RECORDING = [w for w in COMMANDS if re.match(r"export|rerun ", w)]
ENDLESS = [w for w in COMMANDS if w.startswith("emulate ")]


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Iterator[Path]:
    """A folder with its own sockets, in which the commands are typed."""
    folder = tmp_path_factory.mktemp("live")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_RUNTIME_DIR", str(folder))
        patch.setattr(body, "MIN_HOLD_S", 0.0)
        patch.setattr(body, "MIN_RESUME_GAP_S", 0.0)
        patch.chdir(folder)
        yield folder


def copy(rig: str, to: Path, more: str = "") -> None:
    """Write a rig of ours under a name of the papers."""
    to.write_text(shipped_path("rigs", rig).read_text() + more)


def works(words: str, answers: str = "") -> str:
    """Type a command that ends without a request; return its output."""
    done = invoked(*shlex.split(words), answers=answers)
    assert done.code == 0, f"{words}: {done.out}{done.err}"
    return done.out + done.err


def works_until_ctrl_c(process: subprocess.Popen[str], first: str) -> None:
    """Press Ctrl-C once a command that goes on has written ``first``."""
    try:
        assert process.stdout is not None
        written = ""
        while first not in written:
            line = process.stdout.readline()
            assert line, written
            written += line
        process.send_signal(signal.SIGINT)
        assert process.wait(60.0) in (0, 130)
    finally:
        process.kill()
        process.communicate()


def test_commands_to_a_running_head_work(folder):
    """Of one head for all: the expressive one with the track of the tutorial."""
    [agree] = [b.text for b in blocks("yaml") if b.text.startswith('description: "a small nod')]
    (folder / "tracks").mkdir()
    (folder / "tracks" / "agree.yaml").write_text(agree)
    own = "\nsound: {device: silent}\nloop: {rate_hz: 40.0}\n"
    copy("expressive", folder / "head.yaml", own)
    write_wav(folder / "hello.wav", b"\0\0" * 4800, 16000)
    with gazerig.open("head.yaml", mock=True, scene="face-to-face"):
        for words in TO_A_HEAD:
            _works_on_a_head(words)


def _works_on_a_head(words: str) -> None:
    if words == "ctl resume":
        works("stop")
        assert "no hand" in works(words, answers="y\n")
    elif "person" in words:
        wait_for(lambda: invoked(*shlex.split(words)).code == 0, "somebody to be seen")
    else:
        works(words)
    if words == "stop":
        works("ctl resume --confirm")
    works("ctl look free")
    works("ctl revert")


def test_commands_to_servos_work(folder):
    """With emulated ones instead of those on a port."""
    for words in TO_SERVOS:
        copy(
            "maker" if COMMANDS[words] in ("README.md", "start.md") else "desk",
            folder / "myrig.yaml",
        )
        works(f"{words} --mock" + " --once" * (words == "monitor"), answers="y\n")


def test_commands_on_a_recording_work(folder):
    """On one under the name that papers give theirs; a viewer reads the rig's description in it."""
    copy("desk", folder / "my.yaml")
    works("run my.yaml --mock --fast --seconds 1 --scene face-to-face --record evening.mcap")
    (folder / "minute.mcap").write_bytes((folder / "evening.mcap").read_bytes())
    for words in ON_A_RECORDING:
        shown = works(words)
        assert not words.startswith("rerun") or re.search(
            r"\b(\d{3,}) of \1 ticks are bit-identical", shown
        )
    with (folder / "evening.mcap").open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        ((schema, _, message),) = reader.iter_messages(["/robot_description"])
        assert schema is not None and schema.encoding == "jsonschema" and schema.name
        assert json.loads(schema.data)["type"] == "object"
        robot = ElementTree.fromstring(json.loads(message.data)["data"])
        (_, _, state), *_ = reader.iter_messages(["/joint_states"])
    joints = {joint.get("name") for joint in robot.iter("joint")}
    assert {joint["name"] for joint in json.loads(state.data)["joints"]} <= joints


@pytest.mark.pty
def test_commands_that_run_until_they_are_ended_work(folder):
    copy("desk", folder / "my.yaml")
    for words in ENDLESS:
        work = gazerig_branch(*shlex.split(words.replace("/tmp/", f"{folder}/")))
        pipe, both = subprocess.PIPE, subprocess.STDOUT
        works_until_ctrl_c(Branch(work, stdout=pipe, stderr=both, text=True), "/")
