"""Downloads of model files: limited in size, verified and atomic."""

import io
import zipfile
from collections.abc import Callable, Iterable
from http.client import HTTPException
from itertools import groupby
from urllib.request import Request, urlopen

from gazerig.drivers.errors import ModelFileError
from gazerig.drivers.files.file_output import make_folder, write_file
from gazerig.drivers.vision.model_files import ModelFile, models_folder

_CHUNK_BYTES = 1 << 16
_STALLED_S = 30.0

Progress = Callable[[str, float], None]
"""Receives the name of a download, and the share of it that has arrived, 0..1."""


def fetch(files: Iterable[ModelFile], progress: Progress) -> list[ModelFile]:
    """Fetch model files into the folder of models; existing ones stay.

    Args:
        files: Wanted files.
        progress: Receives the progress of each download.

    Returns:
        The fetched files.

    Raises:
        ModelFileError: a file cannot be fetched; the message explains how to get it by hand.
        SetupError: the folder of models cannot be written.
    """
    wanted = [file for file in files if file.state() != "there"]
    make_folder(models_folder())
    for address, group in groupby(wanted, lambda file: file.address):
        members = list(group)
        name = address.rpartition("/")[2]
        try:
            size_bytes = members[0].archive_bytes
            content = bytearray()
            request = Request(address, headers={"User-Agent": "gazerig"})
            with urlopen(request, timeout=_STALLED_S) as reply:
                while chunk := reply.read(_CHUNK_BYTES):
                    content += chunk
                    if len(content) > size_bytes:
                        raise ValueError(f"it has more than the {size_bytes} bytes expected")
                    progress(name, len(content) / size_bytes)
            if len(content) < size_bytes:
                raise ValueError(f"it ends after {len(content)} of {size_bytes} bytes")
            found = [(file, _extract(bytes(content), file)) for file in members]
        except (OSError, ValueError, HTTPException, zipfile.BadZipFile) as error:
            first = members[0]
            part = f"{first.member} of this archive" if first.member else "it"
            raise ModelFileError(
                f"cannot get {first.name} from {address} ({' '.join(str(error).split())}). Everything "
                f"else works without it. To get it by hand: put {part} into {first.path}"
            ) from error
        for file, data in found:
            write_file(file.path, data, force=True)
    return wanted


def _extract(content: bytes, file: ModelFile) -> bytes:
    """Return a model file from a download."""
    if file.member:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            try:
                member = archive.getinfo(file.member)
            except KeyError:
                raise ValueError(f"there is no {file.member} in it") from None
            if member.file_size != file.size_bytes:
                raise ValueError(f"{file.member} in it has another size than expected")
            content = archive.read(member)
    if not file.is_content(content):
        raise ValueError("its content is not the known one (sha256 differs)")
    return content
