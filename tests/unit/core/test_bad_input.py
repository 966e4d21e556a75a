"""Bad input in every file of a configuration: each problem is one line that names file, key, value and bound.

Each test changes every key of a file together, which must give one line per key. So it covers all keys,
also those of future files.
"""

import copy
import math
from collections.abc import Callable, Iterator
from io import StringIO
from pathlib import Path
from typing import Any

import pytest
from ruamel.yaml import YAML

from relform_core.errors import ConfigError
from relform_core.explain import Origins
from relform_core.load import load_scenario
from relform_core.phase_files import read_phase_files
from support.scenarios import CONFIG_FOLDER, PAPER

SECTION_OF_FOLDER = {"vehicles": "vehicle", "sensors": "sensors", "controller": "controller"}
FILES = sorted(
    path.relative_to(CONFIG_FOLDER)
    for folder in ("vehicles", "sensors", "controller", "scenarios")
    for path in (CONFIG_FOLDER / folder).glob("*.yaml")
)
Path_ = tuple[str | int, ...]


def read(path: Path) -> Any:
    """What a file holds, with the samples of paths in it."""
    tree = YAML(typ="safe", pure=True).load(path.read_text())
    read_phase_files(tree, path.parent, Origins(str(path)))
    return tree


def problems(file: Path, tree: Any, folder: Path) -> list[str]:
    """The lines of the error for a file that holds ``tree``, without the file name at their start."""
    stream = StringIO()
    YAML(typ="safe", pure=True).dump(tree, stream)
    path = folder / file.name
    path.write_text(stream.getvalue())
    section = SECTION_OF_FOLDER.get(file.parts[0])
    if section is None:
        for name in SECTION_OF_FOLDER.values():
            if isinstance(reference := tree.get(name), str):
                tree[name] = str(CONFIG_FOLDER / file.parent / reference)
            elif isinstance(reference, dict) and "file" in reference:
                reference["file"] = str(CONFIG_FOLDER / file.parent / reference["file"])
        stream = StringIO()
        YAML(typ="safe", pure=True).dump(tree, stream)
        path.write_text(stream.getvalue())
    with pytest.raises(ConfigError) as caught:
        load_scenario(path) if section is None else load_scenario(PAPER, [f"{section}={path}"])
    lines = str(caught.value).splitlines()
    assert all(line.startswith(f"{path}: ") for line in lines), lines
    return [line.removeprefix(f"{path}: ") for line in lines]


def nodes(tree: Any, path: Path_ = ()) -> Iterator[tuple[Path_, Any]]:
    """Every value of a file with its path, the top level included."""
    yield path, tree
    items = tree.items() if isinstance(tree, dict) else enumerate(tree) if isinstance(tree, list) else ()
    for key, value in items:
        yield from nodes(value, (*path, key))


def at(tree: Any, path: Path_) -> Any:
    for key in path:
        tree = tree[key]
    return tree


def dotted(path: Path_) -> str:
    return ".".join(map(str, path))


def is_named_by_user(path: Path_) -> bool:
    """Whether a key is the name of a formation or of a follower, and not of the schema."""
    return path[0] == "formations_m" and len(path) in (2, 3)


def replaces_key_of_file(path: Path_) -> bool:
    """Whether a key is that of a section in another file; without it the one in the file counts."""
    return len(path) > 1 and path[0] in SECTION_OF_FOLDER.values()


def is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def mutate(
    tree: Any, select: Callable[[Path_, Any], bool], change: Callable[[Any, Path_], None]
) -> tuple[Any, set[str]]:
    """A copy of the tree with a change at every selected path, and these paths."""
    mutated = copy.deepcopy(tree)
    paths = [path for path, value in nodes(tree) if path and select(path, value)]
    for path in paths:
        change(at(mutated, path[:-1]), path)
    return mutated, {dotted(path) for path in paths}


def delete(parent: Any, path: Path_) -> None:
    del parent[path[-1]]


def replace_by(value: Any) -> Callable[[Any, Path_], None]:
    def replace(parent: Any, path: Path_) -> None:
        parent[path[-1]] = value

    return replace


OPTIONAL = {
    "sensing",
    "estimator",
    "formation_step",
    "ground",
    "follower_yaw_max_deg",
    "margin_m",
    "links",
    "obstacles",
    "leg_height_m",
    "turns",
    "yaws_deg",
}
"""Keys that a file may leave out, with all keys below them."""


def is_key(path: Path_, value: Any) -> bool:
    return (
        isinstance(path[-1], str)
        and path[-1] != "kind"
        and OPTIONAL.isdisjoint(path)
        and not replaces_key_of_file(path)
        and not is_named_by_user(path)
    )


def is_text(path: Path_, value: Any) -> bool:
    """Without a file, which cannot be read, and without the target of an event, whose kind comes first."""
    return isinstance(value, str) and path[-1] not in ("file", "target")


def is_number_of_a_key(path: Path_, value: Any) -> bool:
    """Without a number of followers, which may also be a list."""
    return is_number(value) and path[-1] != "followers"


def is_vector(_: Path_, value: Any) -> bool:
    return isinstance(value, list) and len(value) == 3 and all(map(is_number, value))


def is_container(_: Path_, value: Any) -> bool:
    return isinstance(value, (list, dict))


def files_with(select: Callable[[Path_, Any], bool]) -> list[Path]:
    return [
        file
        for file in FILES
        if any(path and select(path, value) for path, value in nodes(read(CONFIG_FOLDER / file)))
    ]


def depths_with(select: Callable[[Path_, Any], bool]) -> list[tuple[Path, int]]:
    """Every file with each depth at which a value is selected."""
    return [
        (file, depth)
        for file in FILES
        for depth in sorted(
            {len(path) for path, value in nodes(read(CONFIG_FOLDER / file)) if path and select(path, value)}
        )
    ]


@pytest.mark.parametrize(("file", "depth"), depths_with(is_key), ids=str)
def test_missing_key(file: Path, depth: int, tmp_path: Path) -> None:
    mutated, keys = mutate(
        read(CONFIG_FOLDER / file), lambda path, value: len(path) == depth and is_key(path, value), delete
    )
    assert set(problems(file, mutated, tmp_path)) == {f"{key}: missing key" for key in keys}


@pytest.mark.parametrize("file", FILES, ids=str)
def test_unknown_key(file: Path, tmp_path: Path) -> None:
    tree = read(CONFIG_FOLDER / file)
    mutated = copy.deepcopy(tree)
    keys = set()
    for path, value in nodes(tree):
        if isinstance(value, dict) and path[:1] != ("formations_m",):
            at(mutated, path)["surprise"] = 1.5
            keys.add(dotted((*path, "surprise")))
    assert set(problems(file, mutated, tmp_path)) == {f"{key}: unknown key" for key in keys}


@pytest.mark.parametrize("file", FILES, ids=str)
@pytest.mark.parametrize("bad", ["'many'", "True", "None", "[2.5]", "{'a': 2.5}", "nan", "-inf"])
def test_value_that_is_not_a_number(file: Path, bad: str, tmp_path: Path) -> None:
    value = eval(bad, {"nan": math.nan, "inf": math.inf})
    mutated, keys = mutate(read(CONFIG_FOLDER / file), is_number_of_a_key, replace_by(value))
    lines = problems(file, mutated, tmp_path)
    assert {line.partition(": must be a")[0] for line in lines} == keys
    assert len(lines) == len(keys)
    shown = "nothing" if value is None else bad
    assert all(line.endswith(f"number (got {shown})") for line in lines)


@pytest.mark.parametrize("file", files_with(is_text), ids=str)
def test_value_that_is_not_text(file: Path, tmp_path: Path) -> None:
    mutated, keys = mutate(read(CONFIG_FOLDER / file), is_text, replace_by(3.25))
    lines = problems(file, mutated, tmp_path)
    assert {line.partition(": must be ")[0] for line in lines} == keys
    assert all("3.25" in line for line in lines)


@pytest.mark.parametrize(("file", "depth"), depths_with(is_container), ids=str)
def test_value_that_is_not_a_list_or_mapping(file: Path, depth: int, tmp_path: Path) -> None:
    def select(path: Path_, value: Any) -> bool:
        return len(path) == depth and is_container(path, value)

    tree = read(CONFIG_FOLDER / file)
    mutated, _ = mutate(tree, select, replace_by(3.25))
    expected = set()
    for path, value in nodes(tree):
        if path and select(path, value):
            wanted = "a list" if isinstance(value, list) else "a mapping of keys to values"
            expected.add(f"{dotted(path)}: must be {wanted} (got 3.25)")
    assert set(problems(file, mutated, tmp_path)) == expected


@pytest.mark.parametrize("file", files_with(is_vector), ids=str)
def test_lists_of_the_wrong_length(file: Path, tmp_path: Path) -> None:
    tree = read(CONFIG_FOLDER / file)
    too_short, keys = mutate(tree, is_vector, lambda parent, path: parent[path[-1]].pop())
    assert set(problems(file, too_short, tmp_path)) == {f"{key}.2: missing item" for key in keys}
    too_long, _ = mutate(tree, is_vector, lambda parent, path: parent[path[-1]].append(0.5))
    lines = problems(file, too_long, tmp_path)
    assert {line.partition(" (got ")[0] for line in lines} == {
        f"{key}: must have at most 3 item(s)" for key in keys
    }


POSITIVE = (0, "greater than 0")
NOT_NEGATIVE = (-0.5, "greater than or equal to 0")
PROBABILITY = (1.25, "less than or equal to 1")
UNBOUNDED = None
OUT_OF_RANGE: dict[str, dict[str, tuple[float, str] | None]] = {
    "vehicles/hummingbird.yaml": {
        "mass_kg": POSITIVE,
        "inertia_kg_m2.*": POSITIVE,
        "arm_length_m": POSITIVE,
        "thrust_coefficient_n_s2": POSITIVE,
        "torque_coefficient_nm_s2": POSITIVE,
        "rotor_speed_min_rpm": NOT_NEGATIVE,
        "rotor_speed_max_rpm": POSITIVE,
        "rotor_time_constant_s": NOT_NEGATIVE,
        "drag_coefficient_n_s_m.*": NOT_NEGATIVE,
        "mass_std_percent": (20, "less than 20"),
        "inertia_std_percent": NOT_NEGATIVE,
        "collision_radius_m": POSITIVE,
        "leg_height_m": POSITIVE,
        "tilt_max_deg": (181, "less than or equal to 180"),
        "failsafe.plan_max_s": (10.5, "less than or equal to 10"),
        "failsafe.descent_speed_m_s": POSITIVE,
    },
    "sensors/paper.yaml": {
        "imu.attitude_std_deg": (180.5, "less than or equal to 180"),
        "imu.gyro_std_deg_s": NOT_NEGATIVE,
        "imu.accelerometer_std_m_s2": NOT_NEGATIVE,
        "imu.yaw_drift_std_deg_s": NOT_NEGATIVE,
        "imu.dropout_probability": PROBABILITY,
        "optic_flow.velocity_std_m_s": NOT_NEGATIVE,
        "optic_flow.dropout_probability": NOT_NEGATIVE,
        "sonar.range_std_m": NOT_NEGATIVE,
        "sonar.range_min_m": NOT_NEGATIVE,
        "sonar.range_max_m": POSITIVE,
        "sonar.field_of_view_deg": (180, "less than 180"),
        "sonar.dropout_probability": PROBABILITY,
        "range_bearing.position_std_m": POSITIVE,
        "range_bearing.range_min_m": NOT_NEGATIVE,
        "range_bearing.range_max_m": POSITIVE,
        "range_bearing.sectors.0.azimuth_min_deg": (-180.5, "greater than or equal to -180"),
        "range_bearing.sectors.0.azimuth_max_deg": (180.5, "less than or equal to 180"),
        "range_bearing.sectors.0.elevation_min_deg": (-90.5, "greater than or equal to -90"),
        "range_bearing.sectors.0.elevation_max_deg": (90.5, "less than or equal to 90"),
        "range_bearing.dropout_probability": PROBABILITY,
        "localization.position_std_m": POSITIVE,
        "localization.velocity_std_m_s": POSITIVE,
        "localization.yaw_std_deg": POSITIVE,
        "localization.dropout_probability": PROBABILITY,
    },
    "controller/paper.yaml": {
        "period_s": (1.5, "less than or equal to 1"),
        "horizon_steps": (1, "greater than or equal to 2"),
        "weights.formation_per_m2": POSITIVE,
        "weights.leader_position_per_m2": NOT_NEGATIVE,
        "weights.leader_yaw_per_rad2": NOT_NEGATIVE,
        "weights.acceleration_per_m2_s4": POSITIVE,
        "weights.torque_per_n2_m2": NOT_NEGATIVE,
        "weights.thrust_rate_per_n2": NOT_NEGATIVE,
        "weights.terminal_scale": POSITIVE,
        "solver.kkt_tolerance_start": POSITIVE,
        "solver.sqp_steps_start_max": (1001, "less than or equal to 1000"),
        "solver.kkt_tolerance": POSITIVE,
        "solver.sqp_steps_max": (0, "greater than or equal to 1"),
        "relative_yaw_std_max_deg": (90.5, "less than or equal to 90"),
        "formation_change.speed_max_m_s": POSITIVE,
        "formation_change.acceleration_max_m_s2": POSITIVE,
        "formation_change.margin_m": NOT_NEGATIVE,
    },
    "scenarios/paper.yaml": {
        "formations_m.initial.follower_1.*": UNBOUNDED,
        "formations_m.initial.follower_2.*": UNBOUNDED,
        "formations_m.wide.follower_1.*": UNBOUNDED,
        "formations_m.wide.follower_2.*": UNBOUNDED,
        "start.position_m.*": UNBOUNDED,
        "start.yaw_deg": (181, "less than or equal to 180"),
        "phases.*.duration_s": POSITIVE,
        "phases.*.steady_from_s": NOT_NEGATIVE,
        "phases.*.motion.ramp_s": NOT_NEGATIVE,
        "phases.*.motion.speed_m_s": (-0.5, "greater than"),
        "phases.*.motion.angle_deg": (361, "less than or equal to 360"),
        "phases.*.motion.turn_s": POSITIVE,
        "phases.*.motion.radius_m": UNBOUNDED,
        "phases.*.motion.climb_m_s": UNBOUNDED,
        "links.*.loss_probability": PROBABILITY,
        "links.*.burst_s": NOT_NEGATIVE,
        "links.*.delay_s": (1.5, "less than or equal to 1"),
        "links.*.jitter_s": (1.5, "less than or equal to 1"),
        "plant.step_s": (0.006, "less than or equal to 0.005"),
        "lockstep.step_timeout_s": POSITIVE,
    },
}
"""For every number in a file: a value that is out of range, and the words of its bound."""


@pytest.mark.parametrize("file", OUT_OF_RANGE)
def test_number_out_of_range(file: str, tmp_path: Path) -> None:
    tree = read(CONFIG_FOLDER / file)
    mutated = copy.deepcopy(tree)
    expected = {}
    for path, value in nodes(tree):
        if not is_number(value):
            continue
        table = OUT_OF_RANGE[file]
        patterns = [key for key in table if Path(dotted(path).replace(".", "/")).match(key.replace(".", "/"))]
        assert len(patterns) == 1, f"{dotted(path)} is not in the table"
        if (row := table[patterns[0]]) is not None:
            at(mutated, path[:-1])[path[-1]] = row[0]
            expected[dotted(path)] = row
    lines = dict(line.split(": must be ", maxsplit=1) for line in problems(Path(file), mutated, tmp_path))
    assert set(lines) == set(expected)
    for key, (value, bound) in expected.items():
        assert lines[key].startswith(bound), key
        assert lines[key].endswith(f"(got {value})"), key
