"""Short words for the keys of a grid."""

from hypothesis import given
from hypothesis import strategies as st

from relform_analysis.sweep.grid import short_keys


@given(
    st.lists(
        st.lists(st.sampled_from(["a", "b", "x_per_m", "x_per_s", "x"]), min_size=1, max_size=4).map(
            ".".join
        ),
        unique=True,
        min_size=1,
    )
)
def test_words_are_never_the_same(keys: list[str]) -> None:
    words = short_keys(keys)
    assert list(words) == keys
    assert len(set(words.values())) == len(keys)
