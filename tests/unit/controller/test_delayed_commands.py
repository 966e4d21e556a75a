"""The controller when commands need time to arrive, in a short agile flight without noise."""

import itertools
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from relform_analysis.flight.simulate import simulate
from relform_controller.ocp import layout
from relform_controller.ocp.problem import HorizonStart, TeamGeometry
from relform_controller.solver.algorithm import ModifiedRti
from relform_core.arrays import Array
from support.flights import AGILE
from support.scenarios import NOISE_FREE, paper_scenario

LATE = paper_scenario(AGILE, *NOISE_FREE, "links.down.delay_s=0.07", seed=5)
LEAD = 2
"""Control periods, rounded up."""


def test_with_a_known_delay_plans_start_where_the_team_will_be(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without noise the prediction is exact, in the middle of an agile flight too."""
    starts: list[tuple[Array, TeamGeometry]] = []
    solve = ModifiedRti.solve

    def listen(solver: ModifiedRti, start: HorizonStart, geometry: TeamGeometry, *others: Any) -> Any:
        starts.append((start.states, geometry))
        return solve(solver, start, geometry, *others)

    monkeypatch.setattr(ModifiedRti, "solve", listen)
    flown = list(itertools.islice(simulate(LATE), 48))
    for step, (states, geometry) in enumerate(starts[:-LEAD]):
        decision = flown[step].decision
        assert decision is not None
        assert decision.stamp_ns == step * 50_000_000
        truth = flown[step + LEAD].ground_truth
        for command in decision.commands.values():
            assert command.stamp_ns == truth["leader"].stamp_ns
        np.testing.assert_allclose(geometry.p_NI_N, truth["leader"].p_NB_N, atol=2e-3)
        for vehicle, name in enumerate(LATE.config.team.vehicles):
            np.testing.assert_allclose(states[vehicle, layout.RATE], truth[name].w_NB_B, atol=5e-3)
        p_12_N = truth["follower_1"].p_NB_N - truth["leader"].p_NB_N
        yaw = Rotation.from_quat(truth["leader"].q_NB).as_euler("ZYX")[0]
        np.testing.assert_allclose(
            geometry.p_I1I2_I1[0], Rotation.from_euler("z", -yaw).apply(p_12_N), atol=2e-3
        )


def test_the_telemetry_of_a_delayed_flight_is_about_the_instant_of_the_measurements() -> None:
    for step, flown in enumerate(itertools.islice(simulate(LATE), 48)):
        assert flown.decision is not None
        state, reference = flown.decision.state, flown.decision.reference
        assert reference.phase == ("P" if step < 20 else "Q")
        off = np.linalg.norm(flown.ground_truth["leader"].p_NB_N - reference.p_NB_N)
        assert state.leader_position_error == pytest.approx(off, abs=1e-4)
