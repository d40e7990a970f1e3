"""What a participant's browser is sent of a screen: nothing that tells conditions apart."""

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
"""How a session must have ended for the debriefing to be sent."""


def page_json(screen: Screen, design: StudyDesign, code: str) -> Json:
    """Return a screen as the participant's page takes it.

    Args:
        screen: what is shown now.
        design: whose words and lengths are shown; its conditions are not looked at.
        code: the participant's.
    """
    match screen:
        case ConsentScreen():
            return _consent(screen, design, code)
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
            # A film that was cut short begins when the participant says so again.
            more: Json = {"on": design.presentation.on, "seconds": screen.seconds, "again": True}
            return {"kind": "presentation", **_place(screen), **more, "film": film}
        case QuestionsScreen():
            return _questions(screen, design)
        case RestScreen():
            return {"kind": "rest", "seconds": screen.seconds}
        case PausedScreen():
            return {"kind": "paused"}
        case EndScreen():
            return _end(screen, design, code)


def _consent(screen: ConsentScreen, design: StudyDesign, code: str) -> Json:
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


def _place(screen: ReadyScreen | PresentationScreen | QuestionsScreen) -> Json:
    step = {"n": screen.number, "of": screen.of, "practice": screen.practice}
    side = None if isinstance(screen, QuestionsScreen) or not screen.pair else screen.side
    return {"step": step if screen.of else None, "side": side}


def _questions(screen: QuestionsScreen, design: StudyDesign) -> Json:
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


def _item(number: str, item: Item, language: str) -> Json:
    """Return a question; its key in the design and its scale stay here."""
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


def _end(screen: EndScreen, design: StudyDesign, code: str) -> Json:
    """Return the last page; who did not stay may still ask for their data to be deleted."""
    told: Mapping[str, object] = {"text": design.texts.debriefing, "code": code}
    return {
        "kind": "end",
        "how": screen.how,
        "contact": design.privacy.contact,
        "code": "" if screen.how == "declined" else code,
        **(told if screen.how == CONDITIONS_ARE_TOLD else {"text": ()}),
    }
