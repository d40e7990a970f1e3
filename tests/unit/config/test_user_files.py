"""Files that a user names: whatever they are, one clear line, and nothing of theirs is lost."""

import os
import socket
from collections.abc import Callable
from functools import partial
from pathlib import Path

import pytest
from command_line import typed
from recorded_run import info_for

from gazerig.config.load import ConfigError
from gazerig.config.schema import load_rig, load_rules, load_walk
from gazerig.drivers.camera.recorder import RecordingWriter
from gazerig.drivers.errors import SetupError
from gazerig.drivers.files.file_output import output_file, refuse_existing, write_file
from gazerig.robot.recording.recorder import Recorder

SECRET = "root:$6$abcdefgh:19000:0:99999:7:::\ndaemon:*:19000:0:99999:7:::\n"


def refused(read):
    """Return the message about a file that cannot be used: one line."""
    with pytest.raises((ConfigError, SetupError)) as reported:
        read()
    text = str(reported.value)
    assert "\n" not in text and text
    return text


@pytest.fixture
def pipe(tmp_path):
    path = tmp_path / "pipe.yaml"
    os.mkfifo(path)
    return path


# -- reading ---------------------------------------------------------------------------


READERS: dict[str, Callable[[str], object]] = {
    "rig": load_rig,
    "character": lambda path: load_rig("desk", path),
    "profile": lambda path: load_rig("desk", None, path),
    "rules": load_rules,
    "walk": load_walk,
}


@pytest.mark.parametrize("reader", READERS.values(), ids=READERS)
def test_what_is_no_regular_file_is_refused_at_once(reader, pipe, tmp_path):
    assert "is a named pipe, not a regular file" in refused(lambda: reader(str(pipe)))
    for device in ("/dev/zero", "/dev/full", "/dev/tty", "/dev/null"):
        if os.path.exists(device):
            assert "is a device" in refused(lambda device=device: reader(device))
    folder = tmp_path / "folder.yaml"
    folder.mkdir()
    assert "is a directory" in refused(lambda: reader(str(folder)))
    assert "absent" in refused(lambda: reader(str(tmp_path / "absent.yaml")))
    empty = tmp_path / "empty.yaml"
    empty.touch()
    refused(lambda: reader(str(empty)))
    binary = tmp_path / "binary.yaml"
    binary.write_bytes(bytes(range(256)) * 9)
    refused(lambda: reader(str(binary)))


@pytest.mark.parametrize("reader", READERS.values(), ids=READERS)
def test_nothing_of_a_file_that_is_no_configuration_is_shown(reader, tmp_path):
    file = tmp_path / "secret.yaml"
    for text in (
        SECRET,
        "token: hunter2\npassword: hunter2\n",
        "hunter2: &hunter2 {hunter2: 1\n",
        "a: *hunter2\n",
        "hunter2: 1\nhunter2: 2\n",
        "? {hunter2: 1}\n: 2\n",
        "!hunter2 {a: 1}\n",
        'a: "hunter2\\q"\n',
        "%hunter2\n---\na: 1\n",
        "@hunter2\n",
    ):
        file.write_text(text)
        said = refused(lambda: reader(str(file)))
        assert str(file) in said
        assert not any(word in said for word in ("hunter2", "root:", "daemon", "$6$")), said


def test_yaml_is_bounded_in_size_and_stands_for_nothing_larger(tmp_path):
    file = tmp_path / "big.yaml"
    with file.open("wb") as big:
        big.truncate(100_000_000)
    assert "larger than the" in refused(lambda: load_rig(str(file)))
    bomb = "name: &a0 [1]\n" + "".join(
        f"a{n + 1}: &a{n + 1} [{f'*a{n},' * 9}]\n" for n in range(12)
    )
    file.write_text(bomb)
    assert "not supported" in str(pytest.raises(ConfigError, load_rig, str(file)).value)


def test_names_can_be_recorded(tmp_path):
    desk = (Path(__file__).parents[3] / "config/rigs/desk.yaml").read_text()
    file = tmp_path / "rig.yaml"
    file.write_text(desk.replace("name: desk", r'name: "\ud800"', 1))
    with pytest.raises(ConfigError, match="invalid Unicode"):
        load_rig(str(file))


# -- writing ---------------------------------------------------------------------------


def test_what_is_there_is_kept_unless_forced(tmp_path):
    file = tmp_path / "file"
    write_file(file, "old")
    with pytest.raises(SetupError, match="already exists: name another file, or use --force"):
        write_file(file, "new")
    assert file.read_text() == "old"
    file.chmod(0o640)
    write_file(file, "new", force=True)
    assert file.read_text() == "new" and file.stat().st_mode & 0o777 == 0o640
    assert os.listdir(tmp_path) == ["file"]


def test_what_fails_half_way_leaves_the_old_file(tmp_path):
    file = tmp_path / "file"
    file.write_text("old")
    with pytest.raises(RuntimeError), output_file(file, force=True) as out:
        out.write(b"half")
        raise RuntimeError
    assert file.read_text() == "old" and os.listdir(tmp_path) == ["file"]


def test_a_link_is_followed_and_stays_one(tmp_path):
    file, link = tmp_path / "file", tmp_path / "link"
    file.write_text("old")
    link.symlink_to(file)
    with pytest.raises(SetupError, match="already exists"):
        write_file(link, "new")
    write_file(link, "new", force=True)
    assert link.is_symlink() and file.read_text() == "new"


@pytest.mark.parametrize("force", [False, True])
def test_a_named_pipe_a_device_or_a_socket_is_refused_at_once(pipe, force):
    link = pipe.with_name("link.yaml")
    link.symlink_to("/dev/full")
    with socket.socket(socket.AF_UNIX) as server:
        server.bind(str(pipe.with_name("socket")))
        for path, what in (
            (pipe, "a named pipe"),
            (Path("/dev/full"), "a device"),
            (link, "a device"),
            (pipe.with_name("socket"), "a socket"),
        ):
            for write in (
                partial(refuse_existing, path, force=force),
                partial(write_file, path, "x", force),
                Recorder(path, info_for(), over=force).open,
                partial(RecordingWriter, path),
            ):
                assert f"{path} is {what}: name a file" in refused(write)


def test_a_full_disk_leaves_the_old_file_whole(tmp_path, small_disk):
    file = tmp_path / "file"
    file.write_text("old")
    with pytest.raises(SetupError, match="File too large"):
        write_file(file, b"x" * 80_000, force=True)
    with pytest.raises(SetupError, match="File too large"), output_file(file, force=True) as out:
        out.write(b"x" * 80_000)
    assert file.read_text() == "old" and os.listdir(tmp_path) == ["file"]


# -- the commands ----------------------------------------------------------------------


@pytest.mark.parametrize(
    "words",
    [
        ("calibrate-board", "{}"),
        ("run", "--mock", "--fast", "--seconds", "1", "--summary", "{}"),
        ("run", "--mock", "--fast", "--seconds", "1", "--record", "{}"),
        ("calibrate", "desk", "--mock", "--out", "{}"),
    ],
    ids=lambda words: words[0] + words[-1][:9],
)
def test_no_command_writes_over_a_file_of_yours(words, tmp_path, capfd):
    for ending in (".png", ".png.html"):
        (tmp_path / f"mine{ending}").write_text("precious")
    mine = str(tmp_path / "mine.png")
    assert typed(*(word.replace("{}", mine) for word in words)) != 0
    assert "unexpected" not in capfd.readouterr().err
    for ending in (".png", ".png.html"):
        assert (tmp_path / f"mine{ending}").read_text() == "precious"
