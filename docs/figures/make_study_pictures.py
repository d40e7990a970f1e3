"""Photograph a study's questions: python docs/figures/make_study_pictures.py (with Chromium)."""

import sys
from functools import partial
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory

TESTS = Path(__file__).parents[2] / "tests"
sys.path.insert(0, str(TESTS / "helpers"))

from browser import Browser, browsing  # noqa: E402
from PIL import Image  # noqa: E402
from shown_page import free_port, wait_for  # noqa: E402
from study_program import Program  # noqa: E402

OUT = Path(__file__).parent
GAP_PX = 20


def _shown(tab: Browser) -> bool | None:
    return "Your impression" in tab.words() or None


def main() -> None:
    """Write the picture."""
    with TemporaryDirectory() as folder:
        study = Path(folder) / "short.yaml"
        study.write_text(
            "title: Short\nconditions: {a: {profile: robot}, b: {profile: mitake}}\n"
            "presentation: {on: head, scene: face-to-face}\n"
            "trials: {seconds: 2, practice: 0}\nquestionnaires: [nakamoto_tsuruno]\n"
            "participants: 2\n"
        )
        page = ("--page", f"127.0.0.1:{free_port()}", "--no-browser", "--data", f"{folder}/data")
        one = Program(str(study), "--mock", "--participant", "1", *page)
        one.do(one.page(), "consent")
        one.do(one.page(), "begin")
        wait_for(lambda: one.page()["step"] == "questions" or None, "the questions")
        pictures = []
        for size in ((1000, 560), (390, 560)):
            with browsing(size) as tab:
                tab.go(f"{one.url}/?token={one.token}")
                wait_for(partial(_shown, tab), "the page")
                tab.run("document.querySelectorAll('input')[3].click()")
                pictures.append(Image.open(BytesIO(tab.photograph())).convert("RGB"))
        one.process.terminate()
        one.process.wait()
    desk, phone = pictures
    both = Image.new("RGB", (desk.width + GAP_PX + phone.width, desk.height), "white")
    both.paste(desk, (0, 0))
    both.paste(phone, (desk.width + GAP_PX, 0))
    both.save(OUT / "study-questions.webp", quality=80, method=6)


if __name__ == "__main__":
    main()
