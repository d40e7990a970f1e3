"""A run of the tests ends with the groups of those that were skipped."""

from skipped_tests import groups


def test_a_group_has_a_count_a_reason_and_a_remedy() -> None:
    browser = "Skipped: no chromium, chromium-browser or google-chrome in the path"
    assert groups([browser, "for a reason", browser]) == [
        "2 skipped: no browser in the path; to enable: apt-get install chromium",
        "1 skipped: for a reason",
    ]


def test_a_reason_without_a_group_is_shown_as_it_is() -> None:
    assert groups(["Skipped: an OAK camera is plugged in"]) == [
        "1 skipped: an OAK camera is plugged in"
    ]
