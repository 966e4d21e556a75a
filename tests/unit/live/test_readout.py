"""The numbers beside the scene."""

import numpy as np

from relform_core.flight_modes import TeamMode, VehicleMode
from relform_core.names import EstimatorMode, SolverState
from relform_core.telemetry import PerStep, TeamStatus
from relform_live.scene.flight_data import FlightData, LogLine, Severity
from relform_live.scene.readout import log_text, readout, waiting
from relform_live.scene.stage import Stage
from support.live_flights import flown, nanoseconds, paper_config, solver, state
from support.pages import Page


def shown(data: FlightData) -> str:
    return Page(readout(data, Stage(data), nanoseconds(12.34), 2.04)).text


def test_numbers_of_a_flight() -> None:
    text = shown(flown(until=1.0, error=np.array([0.06, 0.0, 0.08])))
    assert text.startswith("12.3 s phase B 2.0 × real time")
    assert "formation error 0.050 m (largest 0.100 m)" in text
    assert "leader from its path 0.500 m" in text
    assert "estimator measured NIS 0.83" in text
    assert "solver solved 2 SQP steps, 0.42 ms" in text
    assert "● leader ▪ 0.500 ▪ 0.100 2 of 2" in text
    assert "● follower_1 ▪ 0.100" in text


def test_what_is_not_known_is_left_out() -> None:
    text = shown(FlightData(paper_config()))
    assert "estimator" not in text
    assert "● follower_2 – – 0 of 2" in text


def test_a_flight_from_the_ground_names_the_modes() -> None:
    data = flown(until=1.0)
    modes = {"leader": VehicleMode.HOVERING, "follower_1": VehicleMode.TAKING_OFF}
    status = TeamStatus(TeamMode.TAKING_OFF, "", "start is refused: the team is taking off", modes)
    data.take_status(PerStep(20, nanoseconds(1.0), status))
    text = shown(data)
    assert text.startswith("12.3 s taking off 2.0")
    assert "● leader hovering ▪ 0.500" in text
    assert "● follower_1 taking off ▪" in text
    assert [line.text for line in data.log][-2:] == ["team taking off", status.refused]


def test_trouble_is_named() -> None:
    data = flown(until=1.0)
    data.take_state(state(1.05, mode=EstimatorMode.DEGRADED, reason="<no localization>"))
    data.take_solver(solver(1.05, SolverState.FALLBACK))
    text = shown(data)
    assert "degraded NIS 0.83 <no localization>" in text
    assert "fallback 2 SQP steps, 0.42 ms, 1 fallbacks" in text


def test_texts_of_others_are_no_markup() -> None:
    line = LogLine(nanoseconds(2.0), "<img src=x onerror=alert(1)>", Severity.ERROR)
    for page in (log_text([line]), waiting(line.text)):
        assert "<img" not in page


def test_log_begins_with_the_newest_line() -> None:
    lines = [LogLine(nanoseconds(time), f"line {time}") for time in range(30)]
    text = Page(log_text(lines)).text
    assert text.startswith("29.0 s line 29 28.0 s line 28")
    assert "line 17" not in text
    assert Page(log_text([])).text == "nothing yet"
