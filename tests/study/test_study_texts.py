"""The texts of a study's pages: in every language, and each of them said somewhere."""

import json
import re

from gazerig.features.study.pages.study_files import FOLDER


def test_every_text_is_there_in_every_language_with_the_same_places() -> None:
    texts = json.loads((FOLDER / "texts.json").read_text(encoding="utf-8"))
    assert set(texts) == {"en", "ja", "de"}
    places = {
        language: {key: sorted(re.findall(r"\{\w+\}", text)) for key, text in said.items()}
        for language, said in texts.items()
    }
    assert places["ja"] == places["en"] == places["de"]
    assert all(text.strip() for said in texts.values() for text in said.values())


def test_the_scripts_say_texts_that_are_there_and_no_text_is_left_over() -> None:
    texts = json.loads((FOLDER / "texts.json").read_text(encoding="utf-8"))["en"]
    scripts = "".join(path.read_text(encoding="utf-8") for path in FOLDER.glob("*.js"))
    asked = set(re.findall(r'(?:say|button|tell)\("([\w.]+)"', scripts))
    assert asked <= set(texts)
    patterns = [re.escape(one) for one in re.findall(r'"([\w.]+)"', scripts)]
    patterns += [
        re.sub(r"\\\$\\\{.*?\\\}", r"\\w*", re.escape(one))
        for one in re.findall(r"`([\w.]+\$\{[^`]*)`", scripts)
    ]
    left = {key for key in texts if not any(re.fullmatch(one, key) for one in patterns)}
    assert not left
