"""An R script with exploratory models of a study, for R packages without a Python equivalent."""

from collections.abc import Iterable
from json import dumps

from gazerig.features.study.analysis import StudyAnalysis
from gazerig.features.study.report.apa import measure_words

_BEGINNING = """\
# Exploratory models of a study, written by gazerig beside answers.csv. They decide nothing.
# Needs: install.packages(c("ordinal", "BradleyTerry2")). Run: Rscript exploratory.R
file <- sub("^--file=", "", grep("^--file=", commandArgs(FALSE), value = TRUE))
folder <- if (length(file)) dirname(file) else "."
answers <- read.csv(file.path(folder, "answers.csv"), na.strings = "", stringsAsFactors = FALSE)
answers <- answers[is.na(answers$left_out) & !is.na(answers$trial), ]
"""

_RATINGS = """
# Cumulative-link mixed model. Participants differ in their level and in their preference (random
# intercept and slope; Barr et al. 2013); one answer per condition does not tell a slope from noise.
ratings <- function(name, questionnaire, items, better, than) {
  cat("\\n==", name, "==\\n")
  one <- answers[answers$questionnaire == questionnaire & answers$item %in% items &
                   answers$condition %in% c(better, than), ]
  value <- as.integer(one$value)
  value <- ifelse(one$reverse == "yes", one$points + 1L - value, value)
  one$rating <- factor(value, levels = sort(unique(value)), ordered = TRUE)
  one$better <- as.numeric(one$condition %in% better)
  one$participant <- factor(one$participant)
  one$item <- factor(one$item)
  slopes <- nrow(one) > 2 * nlevels(one$participant)
  model <- paste("rating ~ better +",
                 if (slopes) "(1 + better | participant)" else "(1 | participant)",
                 if (length(items) > 1) "+ (1 | item)")
  print(summary(ordinal::clmm(as.formula(model), data = one)))
}
"""

_CHOICES = """
# Bradley-Terry scores of all conditions. Choices of one participant depend on each other, so the
# intervals are those of a bootstrap over participants.
choices <- function(name, questionnaire, item, conditions) {
  cat("\\n==", name, "==\\n")
  one <- answers[answers$questionnaire == questionnaire & answers$item == item, ]
  one$first <- factor(one$first, levels = conditions)
  one$second <- factor(one$second, levels = conditions)
  one$chosen <- as.numeric(one$value == "first")
  scores <- function(rows) coef(suppressWarnings(
    BradleyTerry2::BTm(chosen, first, second, data = rows)))
  set.seed(1)
  people <- split(seq_len(nrow(one)), one$participant)
  drawn <- replicate(999, scores(one[unlist(sample(people, replace = TRUE)), ]))
  drawn <- matrix(drawn, ncol = 999)
  ends <- apply(drawn, 1, quantile, c(0.025, 0.975), na.rm = TRUE)
  print(cbind(score = scores(one), low95 = ends[1, ], high95 = ends[2, ]))
}
"""


def r_script(study: StudyAnalysis) -> str:
    """Return an R script that reads answers.csv from its own folder.

    It has a mixed model for each hypothesis about ratings, and the Bradley-Terry model of choices.
    """
    design = study.design
    rated = [one for one in study.decisions if one.measure.kind in ("item", "scale")]
    calls = [
        f"ratings({dumps(f'{one.measure.name}: {one.hypothesis.better} > {one.hypothesis.than}')}, "
        f"{dumps(one.measure.questionnaire)}, {_vector(one.measure.items)}, "
        f"{_vector(design.side(one.hypothesis.better))}, {_vector(design.side(one.hypothesis.than))})"
        for one in rated
    ]
    calls += [
        f"choices({dumps(measure_words(one.measure))}, {dumps(one.measure.questionnaire)}, "
        f"{dumps(one.measure.items[0])}, {_vector(design.conditions)})"
        for one in study.choices
    ]
    parts = [_BEGINNING, _RATINGS * bool(rated), _CHOICES * bool(study.choices), "\n"]
    return "".join(parts) + "".join(f"{call}\n" for call in calls)


def _vector(names: Iterable[str]) -> str:
    return f"c({', '.join(dumps(name) for name in names)})"
