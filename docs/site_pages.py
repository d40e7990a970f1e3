"""Pages of the documentation site that are made while it is built.

README, CHANGELOG and the pages about attacks and examples stay where readers of the repository
look for them, and every package gets a page of its reference. Links between them are turned to
where the pages are on the site; a link to any other file of the repository, or to a page of a
feature that was deleted, becomes its words. A link to nothing is left as it is, and the build
fails on it.
"""

import os
import re
from pathlib import Path, PurePosixPath

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.nav import Navigation, Section
from mkdocs.structure.pages import Page

from gazerig.drivers.plugins import SHIPPED

ROOT = Path(__file__).resolve().parents[1]
ROOMS = ("robot", "features", "drivers", "gaze", "config", "sim_mock")

FROM_ELSEWHERE = {
    "README.md": "index.md",
    "CHANGELOG.md": "changelog.md",
    "tests/attack/README.md": "attacks.md",
    "examples/README.md": "examples.md",
}
"""Pages whose source is not in docs/, and their names on the site."""

FIRST = (
    *(
        "index",
        "install",
        "start",
        "tour",
        "glossary",
        "troubleshooting",
        "tutorial",
        "examples",
        "api",
        "hardware",
        "raspberry-pi",
    ),
    *("bringup", "tuning", "lab", "gestures", "world", "study", "stop", "plugins", "add-a-panel"),
)
"""Pages and folders at the head of the navigation, in this order; all others follow by name."""

_LINK = re.compile(r"(!?\[([^\]]*)\])\(([^)#\s]*)(#[^)\s]*)?\)")


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add README, CHANGELOG and their like, and one page for each package."""
    for source, page in FROM_ELSEWHERE.items():
        text = (ROOT / source).read_text(encoding="utf-8")
        files.append(File.generated(config, page, content=_moved(text, source, page)))
    for package, text in _reference().items():
        files.append(File.generated(config, f"reference/{package}.md", content=text))
    return files


def on_nav(nav: Navigation, config: MkDocsConfig, files: Files) -> Navigation:
    """Put what a newcomer reads before what is looked up."""
    nav.items.sort(key=_place)
    return nav


def _place(item: object) -> int:
    name = item.title.lower() if isinstance(item, Section) else ""
    if isinstance(item, Page):
        name = PurePosixPath(item.file.src_uri).stem
    return FIRST.index(name) if name in FIRST else len(FIRST)


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Turn the links of a page in docs/ to where the site has what they name."""
    if page.file.generated_by:
        return markdown
    return _moved(markdown, f"docs/{page.file.src_uri}", page.file.src_uri)


def _reference() -> dict[str, str]:
    """Return the page of each package: its own description, then its modules'."""
    pages = {}
    for room in ROOMS:
        for init in sorted((ROOT / room).rglob("__init__.py")):
            folder = init.parent
            package = ".".join(("gazerig", *folder.relative_to(ROOT).parts))
            modules = sorted(path.stem for path in folder.glob("*.py") if path != init)
            parts = [f"# {package}", f"::: {package}\n    options:\n      show_submodules: false"]
            parts += [f"::: {package}.{module}" for module in modules]
            pages[package] = "\n\n".join(parts) + "\n"
    return pages


def _is_gone(path: str) -> bool:
    """Return whether a file belongs to a feature that was deleted."""
    shipped = (part for parts in SHIPPED.values() for part in parts.values())
    features = {part.split(".")[2] for part in shipped if part.startswith("gazerig.features.")}
    gone = (name for name in features if not (ROOT / "features" / name).exists())
    return any(path.startswith((f"docs/{name}/", f"features/{name}/")) for name in gone)


def _moved(text: str, source: str, page: str) -> str:
    """Return the text with each relative link as it is on the site."""

    def link(match: re.Match[str]) -> str:
        label, words, target, anchor = match[1], match[2], match[3], match[4] or ""
        if not target or ":" in target:
            return match[0]
        path = os.path.normpath(PurePosixPath(source).parent / target)
        on_site = FROM_ELSEWHERE.get(path, path.removeprefix("docs/"))
        if path in FROM_ELSEWHERE or (path != on_site and (ROOT / path).is_file()):
            start = str(PurePosixPath(page).parent)
            return f"{label}({os.path.relpath(on_site, start)}{anchor})"
        return words if (ROOT / path).exists() or _is_gone(path) else match[0]

    return _LINK.sub(link, text)
