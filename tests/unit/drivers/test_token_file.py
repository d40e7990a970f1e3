"""The page's token in a file: the same after a restart, and refused where others could know it."""

import os
from pathlib import Path

import pytest
from shown_page import free_port, wait_for

import gazerig
from gazerig.drivers.errors import SetupError
from gazerig.robot.cli.run import say_publicly
from gazerig.robot.dashboard.door.token_file import read_token
from gazerig.robot.dashboard.feed.page_process import PageProcess

GOOD = "Zk3-_mcd94kfuw82kd01xy"


def written(path: Path, text: str, mode: int = 0o600) -> Path:
    path.write_text(text, encoding="utf-8")
    path.chmod(mode)
    return path


def test_a_missing_file_gets_a_token_that_only_its_owner_can_read(tmp_path):
    path = tmp_path / "token"
    token = read_token(path)
    assert len(token) >= 22 and path.stat().st_mode & 0o777 == 0o600
    assert read_token(path) == token != read_token(tmp_path / "other")


def test_a_token_of_ones_own_is_read(tmp_path):
    assert read_token(written(tmp_path / "token", f"{GOOD}\n", 0o400)) == GOOD


@pytest.mark.parametrize("mode", [0o644, 0o640, 0o604, 0o620])
def test_a_file_that_others_can_read_or_write_is_refused(tmp_path, mode):
    path = written(tmp_path / "token", GOOD, mode)
    with pytest.raises(SetupError, match=f"--token-file {path}: other users may read it"):
        read_token(path)


@pytest.mark.parametrize(
    "text",
    ["", "hello", GOOD[:21], "a" * 40, "abcabc" * 6, f"{GOOD} {GOOD}", GOOD + "é", "x" * 999],
)
def test_a_weak_token_is_refused(tmp_path, text):
    path = written(tmp_path / "token", text)
    with pytest.raises(SetupError, match="a token is 22 to 200 random letters.*remove it"):
        read_token(path)


def test_what_is_no_file_is_refused(tmp_path):
    os.mkfifo(tmp_path / "pipe", 0o600)
    for path, reason in (
        (tmp_path, "Is a directory|not a file"),
        (tmp_path / "none" / "token", "No such file"),
        (tmp_path / "pipe", "not a file"),
    ):
        with pytest.raises(SetupError, match=f"--token-file {path}: ({reason})"):
            read_token(path)


@pytest.mark.usefixtures("ideal_servos")
def test_an_address_is_told_without_a_token_that_is_kept_or_would_be_logged(
    tmp_path, monkeypatch, capsys
):
    line = "the page is at http://127.0.0.1:8080/?token=ab_c-D1"
    say_publicly(line)
    hidden = "the page is at http://127.0.0.1:8080/; gazerig ctl rigs shows it with its token\n"
    assert capsys.readouterr().err == hidden
    monkeypatch.setattr("sys.stderr.isatty", lambda: True, raising=False)
    say_publicly(line)
    assert capsys.readouterr().err.endswith(f"{line}\n")
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    file, said = tmp_path / "token", list[str]()
    page = f"127.0.0.1:{free_port()}"
    address = f"http://{page}/?token="
    # As if its process had started.
    monkeypatch.setattr(PageProcess, "open", lambda _: "the page starts")
    monkeypatch.setattr(PageProcess, "url", lambda _: address + file.read_text().strip())
    with gazerig.open("desk", mock=True, page=page, token_file=file, say=said.append):
        wait_for(lambda: any("the page is at" in one for one in said), "the page's address")
    assert not any("token=" in one for one in said)
