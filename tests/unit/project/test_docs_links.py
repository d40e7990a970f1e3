"""Links of README and docs have targets."""

import re
from pathlib import Path

from papers import PAPERS, ROOT, prose


def slugs(paper: Path) -> set[str]:
    """Return the anchors of a paper's headings, as GitHub makes them."""
    titles = re.findall(r"^#+ (.+)$", prose(paper), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", title.lower()).strip().replace(" ", "-") for title in titles}


def test_links_lead_somewhere():
    for paper in (*PAPERS, ROOT / "CHANGELOG.md"):
        for link in re.findall(r"\]\(([^)]+)\)", prose(paper)):
            if link.startswith("http"):
                continue
            target, _, anchor = link.partition("#")
            file = (paper.parent / target).resolve() if target else paper
            assert file.exists(), f"{paper.name}: {link}"
            assert not anchor or anchor in slugs(file), f"{paper.name}: {link}"
