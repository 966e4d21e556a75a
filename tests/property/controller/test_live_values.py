"""Sequences of changes in flight: accepted values are read back exactly, refused changes have no effect."""

from contextlib import suppress

from hypothesis import given
from hypothesis import strategies as st

from relform_controller.live_values import LiveControllerValues
from relform_controller.reference.mission import ScenarioMission
from relform_core.errors import ConfigError
from support.scenarios import paper_scenario

SCENARIO = paper_scenario()
START = LiveControllerValues.from_scenario(SCENARIO, ScenarioMission(SCENARIO.config).check_formation)
numbers = st.floats(allow_nan=True, allow_infinity=True) | st.floats(0.0, 100.0)
changes = st.dictionaries(
    st.sampled_from(sorted(START.described)), numbers | st.tuples(numbers, numbers, numbers)
)


@given(st.lists(changes, max_size=4))
def test_any_sequence_of_changes(sequence: list[dict[str, float | tuple[float, ...]]]) -> None:
    live, expected = START, dict(START.values)
    for change in sequence:
        with suppress(ConfigError):
            live = live.changed(change)
            expected |= change
        assert dict(live.values) == expected
        for key, described in live.described.items():
            if described.bounded:
                value = expected[key]
                assert isinstance(value, float)
                assert described.lowest <= value <= described.highest
    assert live.weights.formation == expected["weights.formation_per_m2"]
    assert live.formation["follower_2"] == expected["formation.follower_2"]
