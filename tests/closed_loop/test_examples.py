"""The examples that docs/library.md shows, each flown to the end; what they print is what is checked."""

import re

import numpy as np
import pytest

from relform_analysis.flight.simulate import fly_in_process
from relform_core.load import load_scenario
from support.examples import example


def printed(text: str) -> list[float]:
    """The numbers in it that have decimals, or end a sentence of NumPy."""
    return [float(number) for number in re.findall(r"-?\d+\.\d*", text)]


def test_fifteen_lines_fly_what_fly_in_process_flies(capsys: pytest.CaptureFixture[str]) -> None:
    lines = example("fifteen_lines")
    log = fly_in_process(lines.scenario)
    ends = np.array([lines.team.ground_truth[name].p_NB_N for name in log.vehicles])
    assert ends.tobytes() == log.p_NB_N[-1].tobytes()
    assert lines.team.faults == {}
    assert len(capsys.readouterr().out.splitlines()) == len(log.vehicles)


def test_own_plant_ends_in_formation_where_it_started(capsys: pytest.CaptureFixture[str]) -> None:
    example("own_plant").main()
    config = load_scenario("circle").config
    ends = np.array(printed(capsys.readouterr().out)).reshape(-1, 3)
    assert np.linalg.norm(ends - list(config.start_places.values()), axis=1).max() < 0.15


def test_own_cost_term_calms_the_vehicles(capsys: pytest.CaptureFixture[str]) -> None:
    example("own_cost_term").main()
    rate_without, _, rate_with, error_with = printed(capsys.readouterr().out)
    assert rate_with < 0.9 * rate_without
    assert error_with < 0.075


def test_own_estimator_is_better_than_raw_feedback(capsys: pytest.CaptureFixture[str]) -> None:
    example("own_estimator").main()
    raw, own = printed(capsys.readouterr().out)
    assert own < 0.9 * raw


def test_own_leader_reference_is_flown(capsys: pytest.CaptureFixture[str]) -> None:
    example("own_leader_reference").main()
    leader, formation = printed(capsys.readouterr().out)
    assert leader < 0.05
    assert formation < 0.015


def test_own_leader_reference_is_smooth() -> None:
    """Its velocity is the derivative of its position, and it starts at rest."""
    reference = example("own_leader_reference").rolling_circle
    time, step = np.linspace(0.3, 12.0, 40), 1e-5
    measured = (reference(time + step).p_NB_N - reference(time - step).p_NB_N) / (2.0 * step)
    np.testing.assert_allclose(reference(time).v_NB_N, measured, atol=1e-8)
    assert reference(np.zeros(1)).v_NB_N.tolist() == [[0.0, 0.0, 0.0]]
