"""Changes in flight: accepted ones come back exactly, refused ones change nothing, and no others exist."""

from contextlib import suppress

from hypothesis import given
from hypothesis import strategies as st

from relform_controller.tuning import ControllerTuning
from relform_core.errors import ConfigError
from support.scenarios import paper_scenario

START = ControllerTuning.from_scenario(paper_scenario())
numbers = st.floats(allow_nan=True, allow_infinity=True) | st.floats(0.0, 100.0)
changes = st.dictionaries(
    st.sampled_from(sorted(START.tunables)), numbers | st.tuples(numbers, numbers, numbers)
)


@given(st.lists(changes, max_size=4))
def test_any_sequence_of_changes(sequence: list[dict[str, float | tuple[float, ...]]]) -> None:
    tuning, expected = START, dict(START.values)
    for change in sequence:
        with suppress(ConfigError):
            tuning = tuning.changed(change)
            expected |= change
        assert dict(tuning.values) == expected
        for key, tunable in tuning.tunables.items():
            if tunable.bounded:
                value = expected[key]
                assert isinstance(value, float)
                assert tunable.lowest <= value <= tunable.highest
    assert tuning.weights.formation == expected["weights.formation_per_m2"]
    assert tuning.formation["follower_2"] == expected["formation.follower_2"]
