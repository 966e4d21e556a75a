"""Progress of a sweep without a terminal: when a line is written, and its numbers."""

from relform_analysis.sweep.progress import ProgressLines


class Clock:
    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


def test_a_line_every_few_seconds_with_count_rate_and_time_left() -> None:
    lines: list[str] = []
    clock = Clock()
    progress = ProgressLines("flying", 120, 20, lines.append, clock)
    for now, done, lost in ((102.0, 21, 0), (104.9, 25, 0), (105.0, 30, 0), (107.0, 40, 1), (150.0, 70, 2)):
        clock.now = now
        progress.update(done, lost)
    assert lines == [
        "flying: 120 flights, 20 of them flown before",
        # 10 flights in 5 s, 90 left; 50 in 50 s, 50 left.
        "flying: 30 of 120 flights, 2.0 flights/s, 0:00:45 left",
        "flying: 70 of 120 flights, 2 not completed, 1.0 flights/s, 0:00:50 left",
    ]


def test_slow_flights_are_counted_per_minute_and_the_last_line_gives_the_time() -> None:
    lines: list[str] = []
    clock = Clock()
    progress = ProgressLines("wind (2 of 9)", 3, 0, lines.append, clock)
    for now, done in ((130.0, 1), (160.0, 2), (161.0, 3)):
        clock.now = now
        progress.update(done, 0)
    assert lines == [
        "wind (2 of 9): 3 flights",
        "wind (2 of 9): 1 of 3 flights, 2.0 flights/min, 0:01:00 left",
        "wind (2 of 9): 2 of 3 flights, 2.0 flights/min, 0:00:30 left",
        "wind (2 of 9): 3 of 3 flights, 3.0 flights/min, after 0:01:01",
    ]


def test_nothing_left_to_fly_is_one_line() -> None:
    lines: list[str] = []
    ProgressLines("flying", 7, 7, lines.append, Clock())
    assert lines == ["flying: 7 flights, 7 of them flown before"]
