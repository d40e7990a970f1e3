"""The files of the study's pages, equal for every study except for the language."""

from pathlib import Path

from aiohttp import web

from gazerig.robot.dashboard.door.page_files import FOLDER as LIVE_PAGE
from gazerig.robot.dashboard.door.page_files import file_answer

FOLDER = Path(__file__).parent / "browser"
# No external content, no inline content; a film is stored as a blob.
HEADERS = {
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "no-referrer",
    "Cache-Control": "no-store",
    "X-Content-Type-Options": "nosniff",
    "Content-Security-Policy": (
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self'; "
        "connect-src 'self'; media-src blob:; base-uri 'none'; form-action 'none'; "
        "frame-ancestors 'none'"
    ),
}


class StudyFiles:
    """Documents at "/" and "/experimenter", all other files at "/study/NAME"."""

    def __init__(self, language: str) -> None:
        self._language = language

    def add_to(self, router: web.UrlDispatcher) -> None:
        """Add the addresses of all files."""

        async def participant(request: web.Request) -> web.Response:
            document = (FOLDER / "participant.html").read_text(encoding="utf-8")
            spoken = document.replace('lang="en"', f'lang="{self._language}"', 1)
            return web.Response(text=spoken, content_type="text/html", headers=HEADERS)

        async def file(request: web.Request) -> web.Response:
            return file_answer(files[request.path], HEADERS)

        paths = (*FOLDER.iterdir(), LIVE_PAGE / "tokens.css", LIVE_PAGE / "icon.svg")
        files = {f"/study/{path.name}": path for path in paths if path.suffix != ".html"}
        files["/experimenter"] = FOLDER / "experimenter.html"
        files["/rig/stop.js"] = LIVE_PAGE / "stop.js"
        router.add_get("/", participant)
        for address in files:
            router.add_get(address, file)
