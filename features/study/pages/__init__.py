"""The pages of a study: the participant's, and the experimenter's."""
