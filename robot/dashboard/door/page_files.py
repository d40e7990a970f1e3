"""Files of the page that the door serves: document, styles, scripts and icon."""

from pathlib import Path

from aiohttp import web

FOLDER = Path(__file__).parents[1] / "browser"


def add_page_files(router: web.UrlDispatcher) -> None:
    """Add the document at "/", and the files of the folder ``browser`` at "/rig/NAME"."""

    async def document(_: web.Request) -> web.FileResponse:
        return web.FileResponse(FOLDER / "index.html")

    router.add_get("/", document)
    router.add_static("/rig", FOLDER)
