"""The YAML of `ros2 topic echo`, written by relform_cli for speed, equals that of PyYAML."""

import sys
from typing import Any

import yaml
from hypothesis import given
from hypothesis import strategies as st

from relform_cli import yaml_text

TEXTS = st.one_of(
    st.text(max_size=12),
    st.text("ab \n\t:#-'\"\\{}[],&*?|>!%@`~é日😀\x85\u20280123.eE+_=<", max_size=12),
    st.sampled_from(
        ["", "null", "~", "yes", "No", "on", "12", "1e3", "0x1f", "1_000", "2024-01-31", ".inf", "=", "k: "]
    ),
)
SCALARS = st.one_of(TEXTS, st.integers(), st.floats(), st.booleans())
NAMES = st.one_of(
    st.from_regex(r"[a-z][a-z0-9_]*", fullmatch=True), st.sampled_from(["y", "no", "null", "on"])
)


def mappings(values: st.SearchStrategy[Any]) -> st.SearchStrategy[dict[str, Any]]:
    return st.dictionaries(NAMES, values, max_size=4)


MESSAGES = mappings(
    st.recursive(
        SCALARS, lambda values: st.one_of(mappings(values), st.lists(SCALARS, max_size=4)), max_leaves=12
    )
    | st.lists(mappings(SCALARS | st.lists(SCALARS, max_size=3) | mappings(SCALARS)), max_size=3)
)


@given(MESSAGES)
def test_block(message: dict[str, Any]) -> None:
    expected = yaml.dump(
        message,
        allow_unicode=True,
        width=sys.maxsize,
        sort_keys=False,
        default_flow_style=False,
        Dumper=NoAliases,
    )
    assert yaml_text.block(message) == expected


class NoAliases(yaml.Dumper):
    """Writes the same empty list twice as two lists: no two fields of a message share one."""

    def ignore_aliases(self, data: object) -> bool:
        return True


def test_flow_lists() -> None:
    message = {
        "position": {"x": 1.5, "names": ["a b", "yes"]},
        "data": [1, 2],
        "markers": [{"id": 3}],
        "none": [],
    }
    assert yaml_text.with_flow_lists(message) == (
        "position:\n  x: 1.5\n  names: [a b, 'yes']\ndata: [1, 2]\nmarkers: [{id: 3}]\nnone: []\n"
    )
