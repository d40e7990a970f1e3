"""Simulated participants: answers with a known effect, to try a study before the first session.

A rating is a latent normal value cut into equally frequent points: the sum of the participant's own
level, the item's noise, and the shift of the condition. The latent differences of participants
between neighbouring conditions have the required d_z; that of the answers is a little smaller,
because points are whole.
"""

from datetime import UTC, datetime, timedelta
from math import sqrt

import numpy as np
from scipy import special

from gazerig.drivers.errors import SetupError
from gazerig.features.study.design import PAIR, Item, Study, StudyDesign
from gazerig.features.study.journal import AnswerValue, Journal, StudyFolder
from gazerig.features.study.session import PageEvent, StudySession

BETWEEN_SD, ITEM_SD = 0.8, 1.0
"""Standard deviations of participants, and of an item's answers of one participant."""
_MEDIAN_MS = 2600.0
_BEGAN = datetime(2000, 1, 1, tzinfo=UTC)
_ACTIONS = {"consent": "consent", "ready": "begin", "presentation": "seen", "questions": "answer"}


def condition_levels(design: StudyDesign) -> dict[str, int]:
    """Return the rank of each condition by the hypotheses, the lowest at 0."""
    found = dict.fromkeys(design.conditions, 0)
    for _ in design.conditions:  # enough rounds for the longest chain; cycles end, too
        for one in design.hypotheses:
            found[one.better] = max(found[one.better], min(found[one.than] + 1, len(found) - 1))
    return found


def simulate_study(
    study: Study, folder: StudyFolder, count: int, seed: int, effect: float = 0.6
) -> None:
    """Run participants 1 to ``count`` through a study; equal seeds give equal journals.

    ``effect`` is the difference of neighbouring conditions, in standard deviations of the
    differences (d_z).

    Raises:
        SetupError: the folder has data of participants, or the data cannot be written.
    """
    if folder.journals():
        raise SetupError(f"{folder.path} has data already: simulate into a new one, --data FOLDER")
    folder.claim(study)
    for number in range(1, count + 1):
        journal = Journal(folder.participant(number))
        _run_session(study, number, journal, effect, np.random.default_rng((seed, number)))
        journal.close()


def _run_session(
    study: Study, number: int, journal: Journal, effect: float, rng: np.random.Generator
) -> None:
    elapsed_s, own, levels = 0.0, BETWEEN_SD * rng.normal(), condition_levels(study.design)
    middle = 0.5 * max(levels.values())

    def utc() -> str:
        return (_BEGAN + timedelta(days=number, seconds=elapsed_s)).isoformat(timespec="seconds")

    def answer(item: Item) -> AnswerValue:
        step = effect * ITEM_SD * sqrt(2.0)
        shown = session.trial.split(PAIR)
        first, second = (
            step * (levels.get(one, middle) - middle) + ITEM_SD * rng.normal()
            for one in (shown[0], shown[-1])
        )
        if item.kind == "choice":
            return "first" if first > second else "second"
        share = special.ndtr((own + first) / sqrt(BETWEEN_SD**2 + ITEM_SD**2))
        rating = 1 + int(item.points * (1.0 - share if item.reverse else share))
        return rating if item.kind == "rating" else ""

    session = StudySession(study, number, journal, lambda: elapsed_s, utc, simulated=True)
    while (step := session.place.step) != "end":
        times_ms: list[float] = [_MEDIAN_MS * rng.lognormal(0.0, 0.35) for _ in session.items()]
        values = [answer(item) for _, item in session.items()]
        if step == "presentation":
            session.film_fetched()
            elapsed_s += study.design.trials.seconds
        elapsed_s += sum(times_ms) / 1000.0
        session.handle(PageEvent(session.page, _ACTIONS[step], values, times_ms))
