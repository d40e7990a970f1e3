"""Stored answers: an integer of the scale, a side of a pair, text, or None."""

from gazerig.features.study.journal import AnswerValue
from gazerig.features.study.questionnaire import Item

LONGEST_TEXT = 5000
"""Longest free text, characters."""
_SIDES = ("first", "second")


class WrongAnswer(ValueError):
    """A browser sent an answer that does not fit the present page."""


def check_answer(number: int, item: Item, value: object, may_skip: bool) -> AnswerValue:
    """Return an answer in its stored form.

    Raises:
        WrongAnswer: it is missing, or does not fit the item.
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
