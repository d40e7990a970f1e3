"""The files of the study's pages, equal for every study except for the language."""

from pathlib import Path

from aiohttp import web

from gazerig.robot.dashboard.door.page_files import FOLDER as LIVE_PAGE
from gazerig.robot.dashboard.door.page_files import file_answer

FOLDER = Path(__file__).parent / "browser"
_LIVE = {name: LIVE_PAGE / name for name in ("tokens.css", "icon.svg")}
_STOP = LIVE_PAGE / "stop.js"
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
    """Documents at "/" and "/experimenter", all other files at "/study/NAME".

    Args:
        language: language of the participant's page.
    """

    def __init__(self, language: str) -> None:
        self._language = language
        self._files = _LIVE | {path.name: path for path in FOLDER.iterdir() if path.is_file()}

    def add_to(self, router: web.UrlDispatcher) -> None:
        """Add the addresses of all files."""
        router.add_get("/", self._participant)
        router.add_get("/experimenter", self._experimenter)
        router.add_get("/rig/stop.js", self._stop)
        for name in self._files:
            if not name.endswith(".html"):
                router.add_get(f"/study/{name}", self._file)

    async def _participant(self, request: web.Request) -> web.Response:
        document = (FOLDER / "participant.html").read_text(encoding="utf-8")
        spoken = document.replace('lang="en"', f'lang="{self._language}"', 1)
        return web.Response(text=spoken, content_type="text/html", headers=HEADERS)

    async def _experimenter(self, request: web.Request) -> web.Response:
        return file_answer(FOLDER / "experimenter.html", HEADERS)

    async def _stop(self, request: web.Request) -> web.Response:
        return file_answer(_STOP, HEADERS)

    async def _file(self, request: web.Request) -> web.Response:
        return file_answer(self._files[request.path.rpartition("/")[2]], HEADERS)
