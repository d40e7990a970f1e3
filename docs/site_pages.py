"""Pages and menu of the documentation site, made while it is built.

README, CHANGELOG and the pages about attacks and examples stay where readers of the repository
look for them. docs/README.md becomes the menu and the entry page of each section, and every
package gets a page of its reference. Links between them are turned to their pages on the site; a
link to any other file of the repository, or to a page of a feature that was deleted, becomes its
words. A link to nothing is left as it is, and the build fails on it.

Menu and search contain what a user looks for. Pages for readers of the repository (the last heading
of docs/README.md, and the reference) are reached by links.
"""

import os
import re
from collections.abc import Sequence
from pathlib import Path, PurePosixPath
from typing import Any

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files, InclusionLevel
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

CONTENTS = "docs/README.md"
"""The menu: one section for each of its headings but the last, in this order."""

QUESTIONS = "docs/questions.md"
"""What people search for, and its page: the words weigh more than a page's own text."""

_QUESTION = re.compile(r"^\| ([^|]+?) \| \[.+\]\((.+)\) \|$", re.MULTILINE)
_ARTICLE = re.compile(r"\b(a|an|of|the) ")
_ANCHOR = re.compile(r"\]\(#([^)]+)\)")
_LINK = re.compile(r"(!?\[([^\]]*)\])\(([^)#\s]*)(#[^)\s]*)?\)")


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add README, CHANGELOG and their like, the entry of each section, and the reference."""
    for source, page in FROM_ELSEWHERE.items():
        text = (ROOT / source).read_text(encoding="utf-8")
        files.append(File.generated(config, page, content=_moved(text, source, page)))
    reference = _reference()
    for page, text in reference.items():
        files.append(File.generated(config, page, content=text))
    config.nav = [{"Home": "index.md"}]
    for title, text in _sections().items():
        entry = f"{title.lower().replace(' ', '-')}/index.md"
        listed = _ANCHOR.sub(r"](../\1/index.md)", _moved(text, CONTENTS, entry))
        pages = [entry, *_menu(text, files)]
        if title == list(_sections())[-1]:
            packages = "\n".join(f"- [{page[10:-3]}](../{page})" for page in reference)
            listed += f"\n## Reference\n\n{packages}\n"
            config["hidden"] = {*_names(pages), *reference}
        else:
            config.nav.append({title: pages})
        files.append(File.generated(config, entry, content=f"# {title}\n{listed}"))
    for file in files.documentation_pages():
        if file.src_uri in config["hidden"]:
            file.inclusion = InclusionLevel.NOT_IN_NAV
    return files


def questions() -> list[tuple[str, str]]:
    """Return what people search for, with the page in docs/ that answers it."""
    return _QUESTION.findall((ROOT / QUESTIONS).read_text(encoding="utf-8"))


def _names(pages: Sequence[Any]) -> list[str]:
    """Return the file names of a part of the menu."""
    names = []
    for page in pages:
        inner = list(page.values()) if isinstance(page, dict) else page
        names += [page] if isinstance(page, str) else _names(inner)
    return names


def _sections() -> dict[str, str]:
    """Return the text below each heading of the contents."""
    text = (ROOT / CONTENTS).read_text(encoding="utf-8")
    parts = re.split(r"^## (.+)$", text, flags=re.MULTILINE)[1:]
    return dict(zip(parts[::2], parts[1::2], strict=True))


def _menu(text: str, files: Files) -> list[dict[str, str | list[str]]]:
    """Return the menu of a section; an index page brings the other pages of its folder."""
    menu: list[dict[str, str | list[str]]] = []
    for title, target in re.findall(r"^- \[(.+?)\]\((\S+?)\)", text, re.MULTILINE):
        path = os.path.normpath(f"docs/{target}")
        page = FROM_ELSEWHERE.get(path, path.removeprefix("docs/"))
        if files.get_file_from_path(page) is None:
            continue  # of a feature that was deleted
        folder, _, name = page.rpartition("/")
        pages = sorted(file.src_uri for file in files if file.src_uri.startswith(f"{folder}/00"))
        menu.append({title: [page, *pages] if name == "index.md" else page})
    return menu


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Turn the links of a page to their pages on the site; hide records from the search."""
    if page.file.src_uri in config["hidden"]:
        page.meta["search"] = {"exclude": True}
    page.meta["tags"] = [
        _ARTICLE.sub("", asked) for asked, target in questions() if target == page.file.src_uri
    ]
    if page.file.generated_by:
        return markdown
    return _moved(markdown, f"docs/{page.file.src_uri}", page.file.src_uri)


def _reference() -> dict[str, str]:
    """Return the page of each package by its name: its own description, then its modules'."""
    pages = {}
    for room in ROOMS:
        for init in sorted((ROOT / room).rglob("__init__.py")):
            folder = init.parent
            package = ".".join(("gazerig", *folder.relative_to(ROOT).parts))
            modules = sorted(path.stem for path in folder.glob("*.py") if path != init)
            parts = [f"# {package}", f"::: {package}\n    options:\n      show_submodules: false"]
            parts += [f"::: {package}.{module}" for module in modules]
            pages[f"reference/{package}.md"] = "\n\n".join(parts) + "\n"
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
        on_site = "index.md" if path == CONTENTS else path.removeprefix("docs/")
        on_site = FROM_ELSEWHERE.get(path, on_site)
        if path in FROM_ELSEWHERE or (path != on_site and (ROOT / path).is_file()):
            start = str(PurePosixPath(page).parent)
            return f"{label}({os.path.relpath(on_site, start)}{anchor})"
        return words if (ROOT / path).exists() or _is_gone(path) else match[0]

    return _LINK.sub(link, text)
