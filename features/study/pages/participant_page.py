"""The participant's page as JSON: nothing in it distinguishes conditions."""

from collections.abc import Mapping

from gazerig.features.study.design import StudyDesign
from gazerig.features.study.questionnaire import Item, Texts
from gazerig.features.study.screens import (
    ConsentScreen,
    EndScreen,
    InstructionsScreen,
    PausedScreen,
    PresentationScreen,
    QuestionsScreen,
    ReadyScreen,
    RestScreen,
    Screen,
)

Json = dict[str, object]
CONDITIONS_ARE_TOLD = "finished"
"""Ending of a session after which the debriefing is sent."""


def page_json(screen: Screen, design: StudyDesign, code: str) -> Json:
    """Return a screen as JSON for the participant's page.

    Args:
        screen: the present screen.
        design: the texts and durations; its conditions are not used.
        code: code of the participant.
    """
    match screen:
        case ConsentScreen():
            uses = {"gaze": screen.gaze, "pictures": screen.pictures}
            return {
                "kind": "consent",
                "code": code,
                "welcome": design.texts.welcome,
                "uses": [use for use, asked in uses.items() if asked],
                "camera": design.presentation.on == "head",
                "days": design.privacy.deleted_after_days,
                "contact": design.privacy.contact,
            }
        case InstructionsScreen():
            return {
                "kind": "instructions",
                "on": design.presentation.on,
                "pairs": design.task == "pairwise",
                "count": screen.trials,
                "practice": screen.practice,
                "seconds": screen.seconds,
            }
        case ReadyScreen():
            return {
                "kind": "ready",
                **_place(screen),
                "on": design.presentation.on,
                "seconds": design.trials.seconds,
                "again": screen.again,
            }
        case PresentationScreen():
            film = f"/study/film/{screen.film}" if screen.film else None
            # A film that was cut short starts again at the participant's request.
            more: Json = {"on": design.presentation.on, "seconds": screen.seconds, "again": True}
            return {"kind": "presentation", **_place(screen), **more, "film": film}
        case QuestionsScreen():
            language = design.language
            return {
                "kind": "questions",
                **_place(screen),
                "after": screen.once,
                "may_skip": design.may_skip,
                "instruction": _in(screen.instruction, language),
                "instruction_language": language if language in screen.instruction else "en",
                "items": [_item(str(one.number), one.item, language) for one in screen.questions],
            }
        case RestScreen():
            return {"kind": "rest", "seconds": screen.seconds}
        case PausedScreen():
            return {"kind": "paused"}
        case EndScreen():
            told: Mapping[str, object] = {"text": design.texts.debriefing, "code": code}
            return {
                "kind": "end",
                "how": screen.how,
                "contact": design.privacy.contact,
                "code": "" if screen.how == "declined" else code,
                **(told if screen.how == CONDITIONS_ARE_TOLD else {"text": ()}),
            }


def _place(screen: ReadyScreen | PresentationScreen | QuestionsScreen) -> Json:
    step = {"n": screen.number, "of": screen.of, "practice": screen.practice}
    side = None if isinstance(screen, QuestionsScreen) or not screen.pair else screen.side
    return {"step": step if screen.of else None, "side": side}


def _item(number: str, item: Item, language: str) -> Json:
    """Return a question without its key in the design and its scale."""
    texts = [one for one in (item.text, item.low, item.high) if one]
    spoken = language if all(language in one for one in texts) else "en"
    return {
        "key": number,
        "kind": item.kind,
        "points": item.points,
        "language": spoken,
        "text": _in(item.text, spoken),
        "low": _in(item.low, spoken),
        "high": _in(item.high, spoken),
    }


def _in(texts: Texts, language: str) -> str:
    return texts.get(language, texts.get("en", ""))
