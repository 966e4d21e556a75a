"""Selection of topics as in ``ros2 bag``."""

import pytest

from relform_bags.topic_selection import TopicSelection, absolute
from relform_core.errors import BagError

TOPICS = {"/leader/imu": "Imu", "/leader/sonar": "Range", "/follower_1/imu": "Imu", "/clock": "Clock"}


def taken(selection: TopicSelection) -> list[str]:
    return [name for name, type_name in TOPICS.items() if selection.takes(name, type_name)]


@pytest.mark.parametrize(
    ("selection", "expected"),
    [
        (TopicSelection(), list(TOPICS)),
        (TopicSelection(names=["/clock"]), ["/clock"]),
        (TopicSelection(types=["Imu"]), ["/leader/imu", "/follower_1/imu"]),
        (TopicSelection(names=["/clock"], types=["Range"]), ["/leader/sonar", "/clock"]),
        (TopicSelection(regex="leader"), ["/leader/imu", "/leader/sonar"]),
        (TopicSelection(regex="leader", whole_name=True), []),
        (TopicSelection(regex="/leader/.*", whole_name=True), ["/leader/imu", "/leader/sonar"]),
        (TopicSelection(names=["/clock"], regex="son"), ["/leader/sonar", "/clock"]),
        (TopicSelection(exclude_regex="imu"), ["/leader/sonar", "/clock"]),
        (TopicSelection(exclude_regex="imu", whole_name=True), list(TOPICS)),
        (TopicSelection(types=["Imu"], exclude_names=["/leader/imu"]), ["/follower_1/imu"]),
        (TopicSelection(regex="leader", exclude_types=["Imu"]), ["/leader/sonar"]),
    ],
)
def test_selected_topics(selection: TopicSelection, expected: list[str]) -> None:
    assert taken(selection) == expected


@pytest.mark.parametrize("name", ["regex", "exclude_regex"])
def test_invalid_expression_is_refused(name: str) -> None:
    with pytest.raises(
        BagError, match=r"^'\[a' is not a valid regular expression: unterminated character set"
    ):
        TopicSelection(**{name: "[a"})


def test_names_become_absolute() -> None:
    assert [absolute(name) for name in ("imu", "/leader/imu")] == ["/imu", "/leader/imu"]
