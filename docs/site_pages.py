"""Pages of the documentation site whose source is not in docs/, made while it is built.

README, CHANGELOG and the pages about attacks and examples stay where readers of the repository
look for them; the list of all parameters is written from the declarations in the code. Links
between pages are turned to their pages on the site; a link to any other file of the repository
becomes its words. A link to nothing is left as it is, and the build fails on it.
"""

import os
import re
import sys
from pathlib import Path, PurePosixPath

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

sys.path.append(str(Path(__file__).parent))
from parameters_page import parameters_page  # noqa: E402  # MkDocs loads this file by its path

ROOT = Path(__file__).resolve().parents[1]

FROM_ELSEWHERE = {
    "README.md": "index.md",
    "CHANGELOG.md": "changelog.md",
    "tests/judges/attack/README.md": "attacks.md",
    "examples/README.md": "examples.md",
}
"""Pages whose source is not in docs/, and their names on the site."""

_LINK = re.compile(r"(!?\[([^\]]*)\])\(([^)#\s]*)(#[^)\s]*)?\)")


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add README, CHANGELOG and their like, and the list of all parameters."""
    for source, page in FROM_ELSEWHERE.items():
        text = (ROOT / source).read_text(encoding="utf-8")
        files.append(File.generated(config, page, content=_moved(text, source, page)))
    files.append(File.generated(config, "parameters.md", content=parameters_page()))
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Turn the links of a page to their pages on the site."""
    if page.file.generated_by:
        return markdown
    return _moved(markdown, f"docs/{page.file.src_uri}", page.file.src_uri)


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
        return words if (ROOT / path).exists() else match[0]

    return _LINK.sub(link, text)
