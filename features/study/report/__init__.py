"""The report of a study: page, figures, sentences, tidy table and BIDS layout."""
