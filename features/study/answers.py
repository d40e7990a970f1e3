"""Answers as they are kept: whole numbers of the scale, a side of a pair, text, or none."""

from gazerig.features.study.questionnaire import Item
from gazerig.features.study.records import AnswerValue

LONGEST_TEXT = 5000
"""Characters of a free text."""
_SIDES = ("first", "second")


class WrongAnswer(ValueError):
    """What a browser sent does not fit the page that is shown."""


def checked(number: int, item: Item, value: object, may_skip: bool) -> AnswerValue:
    """Return an answer as it is kept.

    Args:
        number: of the question on its page, for messages.
        item: that was asked.
        value: what was answered, None for nothing.
        may_skip: the study permits unanswered questions.

    Raises:
        WrongAnswer: it is missing, or not as the item can be answered.
    """
    if item.kind == "text":
        text = "" if value is None else value
        if not isinstance(text, str) or len(text) > LONGEST_TEXT:
            raise WrongAnswer(f"question {number}: a text of up to {LONGEST_TEXT} characters")
        return text
    if value is None and may_skip:
        return None
    if value is None:
        raise WrongAnswer(f"question {number} is not answered")
    if item.kind == "choice":
        if value not in _SIDES:
            raise WrongAnswer(f"question {number}: {' or '.join(_SIDES)}")
        return str(value)
    if type(value) is not int or not 1 <= value <= item.points:
        raise WrongAnswer(f"question {number}: a whole number from 1 to {item.points}")
    return value
