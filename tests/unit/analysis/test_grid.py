"""Grids over parameters: their variants, the names of these, and what is refused before any flight."""

import re
from pathlib import Path

import pytest

from relform_analysis.sweep.grid import grid_variants, parse_grid, short_keys
from relform_analysis.sweep.plan import load_variants, plan_runs
from relform_core.errors import ConfigError
from support.scenarios import PAPER
from support.sweeps import short_phases

FORMATION, TORQUE = "controller.weights.formation_per_m2", "controller.weights.torque_per_n2_m2"


def error_of(*options: str, overrides: tuple[str, ...] = ()) -> str:
    with pytest.raises(ConfigError) as error:
        plan_runs(PAPER, grid_variants(parse_grid(options)), overrides, [1])
    assert "\n" not in str(error.value)
    return str(error.value)


def test_a_grid_is_every_combination_of_its_values() -> None:
    variants = grid_variants(parse_grid([f"{FORMATION}=1,10", f"{TORQUE} = 5, 0.25,20"]))
    assert [variant.name for variant in variants] == [
        "formation-1_torque-5", "formation-1_torque-0.25", "formation-1_torque-20",
        "formation-10_torque-5", "formation-10_torque-0.25", "formation-10_torque-20",
    ]  # fmt: skip
    assert variants[1].title == "formation 1, torque 0.25"
    assert variants[1].set == (f"{FORMATION}=1", f"{TORQUE}=0.25")
    assert variants[1].parameters == {FORMATION: 1, TORQUE: 0.25}


def test_a_grid_reaches_the_configuration() -> None:
    grid = parse_grid([f"{TORQUE}=5,12.5", "controller=retuned,team"])
    runs = plan_runs(PAPER, grid_variants(grid), [short_phases(0.25)], [7, 8])
    assert len(runs) == 8
    found = [
        (run.scenario.config.controller.weights.torque, run.scenario.config.controller.estimator.kind)
        for run in runs
    ]
    assert found[:4] == [(5.0, "raw"), (5.0, "team"), (12.5, "raw"), (12.5, "team")]
    assert runs[3].name == "torque-12.5_controller-team-s7"


def test_a_file_may_hold_a_grid(tmp_path: Path) -> None:
    file = tmp_path / "grid.yaml"
    file.write_text(f"grid: {{{TORQUE}: [5, 10], controller: [../b.yaml, team]}}")
    variants = load_variants(file)
    assert len(variants) == 4
    assert variants[0].set == (f"{TORQUE}=5", f"controller={tmp_path.parent / 'b.yaml'}")
    assert variants[0].parameters == {TORQUE: 5, "controller": "../b.yaml"}
    assert variants[1].set == (f"{TORQUE}=5", "controller=team")


def test_values_of_any_kind_are_written_as_overrides() -> None:
    (variant,) = grid_variants(parse_grid(["start.position_m=[1.0,-2.5,3.0]"]))
    assert variant.set == ("start.position_m=[1.0, -2.5, 3.0]",)
    assert re.fullmatch(r"position_m--1\.0--2\.5-3\.0--[0-9a-f]{8}", variant.name)
    assert variant.title == "position_m [1.0, -2.5, 3.0]"
    negative, false, text, small = grid_variants(parse_grid(["a.b=-5,false,'false',1e-9"]))
    assert [v.set for v in (negative, false, text, small)] == [
        ("a.b=-5",),
        ("a.b=false",),
        ('a.b="false"',),
        ("a.b=1e-09",),
    ]
    (whole,) = grid_variants({"a.b": [40.0]})
    assert (whole.name, whole.title, whole.set) == ("b-40", "b 40", ("a.b=40.0",))
    assert [v.name for v in (negative, false, small)] == ["b--5", "b-false", "b-1e-09"]


def test_words_are_short_and_tell_keys_apart() -> None:
    keys = [
        "vehicle.drag_coefficient_n_s_m",
        "plant.drag_coefficient_n_s_m",
        TORQUE,
        "phases.1.duration_s",
        "phases.2.duration_s",
    ]
    assert list(short_keys(keys).values()) == [
        *keys[:2], "torque", "1.duration_s", "2.duration_s",
    ]  # fmt: skip
    assert short_keys(["controller.weights.torque_per_n2_m2", "plant.torque_per_m"]) == {
        "controller.weights.torque_per_n2_m2": "torque_per_n2_m2", "plant.torque_per_m": "torque_per_m",
    }  # fmt: skip


def test_long_names_stay_names_of_files_and_stay_apart() -> None:
    keys = [f"section.a_rather_long_parameter_{letter}" for letter in "abc"]
    variants = grid_variants({key: [1.5, 2.5] for key in keys})
    names = {variant.name for variant in variants}
    assert len(names) == 8
    assert all(len(variant.name) == 64 and len(variant.title) == 64 for variant in variants)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ([f"{TORQUE}=5,-1"], f"--grid {TORQUE}: must be greater than or equal to 0 (got -1)"),
        ([f"{TORQUE}=5,2e6"], f"--grid {TORQUE}: must be less than or equal to 1000000 (got 2000000.0)"),
        ([f"{TORQUE}=5,high"], f"--grid {TORQUE}: must be a number (got 'high')"),
        ([f"{TORQUE}="], f"--grid {TORQUE}: needs at least one value"),
        ([f"{TORQUE}=5,10,5.0"], f"--grid {TORQUE}: has the value 5 twice"),
        (
            [f"{TORQUE}=5", f"{TORQUE}=10"],
            f"--grid {TORQUE}: is given twice; list all its values in one --grid",
        ),
        ([TORQUE], f"--grid {TORQUE}: must have the form some.key=value,value"),
        (["=5,10"], "--grid =5,10: must have the form some.key=value,value"),
        ([f"{TORQUE}=5]"], f"--grid {TORQUE}=5]: the values are no list in YAML, such as 5,10,20"),
        ([f"{TORQUE}=2026-11-28"], f"--grid {TORQUE}=2026-11-28: the values are no list in YAML, such as"),
        (["seed=1,2"], "--grid seed: a sweep flies many; --seed is the first of them"),
        (["controller=nowhere,team"], "--grid controller=nowhere: unknown controller 'nowhere': expected"),
        (
            ["a.b=" + ",".join(map(str, range(40))), "a.c=" + ",".join(map(str, range(30)))],
            "--grid: 40 x 30 values give more than 1000 variants; list fewer",
        ),
    ],
)  # fmt: skip
def test_what_cannot_be_flown_is_one_line_that_names_key_value_and_bound(
    options: list[str], message: str
) -> None:
    assert error_of(*options).startswith(message)


def test_an_unknown_key_is_named_with_the_one_that_was_meant() -> None:
    assert error_of("controller.weights.torqe_per_n2_m2=5,10") == (
        "--grid controller.weights.torqe_per_n2_m2: unknown key (did you mean 'torque_per_n2_m2'?)"
    )
    assert error_of("controller.weights.torque=5").endswith("unknown key (did you mean 'torque_per_n2_m2'?)")
    assert error_of("controller.weihgts.torque_per_n2_m2=5") == (
        "--grid controller.weihgts.torque_per_n2_m2=5: unknown key 'weihgts' (did you mean 'weights'?)"
    )
    assert error_of("one key=5").startswith("--grid one key: unknown key")


def test_a_key_is_in_the_grid_or_set_for_all_variants() -> None:
    assert error_of(f"{TORQUE}=5,10", overrides=(f"{TORQUE}=3",)) == (
        f"--grid {TORQUE}: --set has it, too; leave one of them out"
    )


def test_an_error_of_another_key_names_the_variant() -> None:
    assert error_of(f"{TORQUE}=5", overrides=("controller.horizon_steps=0",)).startswith(
        "variant 'torque-5': --set controller.horizon_steps: must be"
    )


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("grid: {}", "grid: must have at least 1 item(s) (got {})"),
        ("grid: {a.b: []}", "grid.a.b: needs at least one value"),
        ("grid: {a.b: 5}", "grid.a.b: must be a list (got 5)"),
        ("grid: [a.b]", "grid: must be a mapping of keys to values (got ['a.b'])"),
        ("grid: {a.b: [1], a.b: [2]}", None),
        (
            "{grid: {a.b: [1]}, variants: [{name: a, title: b, set: []}]}",
            "has both variants and a grid; a sweep needs one of them",
        ),
        ("{}", "has neither variants nor a grid; a sweep needs one of them"),
    ],
)  # fmt: skip
def test_bad_grids_in_a_file(tmp_path: Path, text: str, message: str | None) -> None:
    file = tmp_path / "grid.yaml"
    file.write_text(text)
    with pytest.raises(ConfigError) as error:
        load_variants(file)
    expected = f"{file}: {message}" if message else f'{file}:1:18: not valid YAML: found duplicate key "a.b"'
    assert str(error.value).startswith(expected)
