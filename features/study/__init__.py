"""A study in which people rate two to six gazes: design, sessions, statistics, report.

Interface: the command ``study`` (commands.py); the schemas ``study`` and ``questionnaire``
(``design.StudyDesign``, ``questionnaire.Questionnaire``); ``run.study_file.load_checked_study``
reads a study. It needs the feature ``lab``, and ``world`` to render films.

In this folder: the design, the order of trials, records, decisions and their texts; statistics/:
tests and effect sizes; run/: the process of the head, films, measures of trials; pages/: the
participant's and the experimenter's page; report/: page, tables and BIDS data set; cli/: the
commands; studies/ and questionnaires/: the shipped YAML files.
"""
