"""Files of the page that the door serves: document, styles, scripts and icon."""

from collections.abc import Mapping
from pathlib import Path

from aiohttp import web

FOLDER = Path(__file__).parents[1] / "browser"
_DOCUMENT = "index.html"
_TYPES = {
    ".html": "text/html",
    ".css": "text/css",
    ".js": "text/javascript",
    ".svg": "image/svg+xml",
    ".json": "application/json",
}
# Allow scripts and connections of this address only. Panels contain their own styles, and the page
# itself creates the camera image and the icon of the tab.
_MAY = {
    "Content-Security-Policy": (
        "default-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; "
        "media-src 'self' blob:; object-src 'none'; base-uri 'none'; form-action 'none'; "
        "frame-ancestors 'none'"
    ),
}


class PageFiles:
    """Files of the folder ``browser``: the document at "/", the others at "/rig/NAME"."""

    def __init__(self, headers: Mapping[str, str]) -> None:
        self._headers = {**headers, **_MAY}
        self._files = {path.name: path for path in FOLDER.iterdir() if path.suffix in _TYPES}

    def add_to(self, router: web.UrlDispatcher) -> None:
        """Add the routes of all files."""

        async def answer(request: web.Request) -> web.Response:
            name = request.path.rpartition("/")[2] or _DOCUMENT
            return file_answer(self._files[name], self._headers)

        router.add_get("/", answer)
        for name in self._files:
            if name != _DOCUMENT:
                router.add_get(f"/rig/{name}", answer)


def file_answer(path: Path, headers: Mapping[str, str]) -> web.Response:
    """Return the present content of a file; it is small and may have been edited."""
    return web.Response(
        body=path.read_bytes(),
        content_type=_TYPES[path.suffix],
        charset="utf-8",
        headers=headers,
    )
