"""Our bags, read by the libraries of Foxglove; skipped without node."""

import hashlib
import json
import math
import shutil
import subprocess
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.exceptions import EndOfFile
from mcap.reader import NonSeekingReader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from relform_bags.reader import BagMessage, bag_files, read_bag
from relform_bags.recover import recover_bag
from relform_bags.split_limits import SplitLimits
from support.bags import TOPICS, write_bag

SOURCE = Path(__file__).parent / "node_readers"
SHORT_FLIGHT = Path(__file__).parents[2] / "data/short_flight"
MODES = ["indexed", "streaming"]
Topics = dict[str, dict[str, Any]]


@pytest.fixture(scope="module")
def script(pytestconfig: pytest.Config) -> Path:
    """read_bag.mjs beside the libraries that it needs; later runs find them installed."""
    if shutil.which("node") is None or shutil.which("npm") is None:
        pytest.skip("there is no node, or no npm")
    assert pytestconfig.cache is not None
    lock = (SOURCE / "package-lock.json").read_bytes()
    folder = pytestconfig.cache.mkdir(f"node_readers_{hashlib.sha256(lock).hexdigest()[:12]}")
    for file in SOURCE.iterdir():
        if file.is_file():
            shutil.copy(file, folder)
    if not (folder / "node_modules/.package-lock.json").exists():
        command = ["npm", "ci", "--ignore-scripts", "--no-audit", "--no-fund", "--fetch-retries=0"]
        try:
            subprocess.run(command, cwd=folder, capture_output=True, check=True, text=True, timeout=60.0)
        except subprocess.SubprocessError as error:
            shutil.rmtree(folder)
            pytest.skip(f"npm cannot install the readers: {error}")
    return folder / "read_bag.mjs"


def read_with_node(script: Path, mode: str, file: Path) -> Topics:
    reading = subprocess.run(["node", script, mode, file], capture_output=True, text=True)
    assert reading.returncode == 0, reading.stderr
    return dict(json.loads(reading.stdout))


def expected(file: Path) -> Topics:
    """The same, read by rosbags with the definitions in the bag; the installed types may be newer."""
    definitions = definitions_in(file)
    store = get_typestore(Stores.EMPTY)
    names: dict[str, list[str]] = {}
    topics: Topics = {}
    for entry in read_bag(file):
        if isinstance(entry, BagMessage):
            if entry.type_name not in store.types:
                store.register(get_types_from_msg(definitions[entry.type_name], entry.type_name))
                names = {name: [field for field, _ in fields[1]] for name, fields in store.fielddefs.items()}
            topic = topics.setdefault(entry.topic, {"type": entry.type_name, "logTimes": [], "messages": []})
            topic["logTimes"].append(str(entry.log_time_ns))
            topic["messages"].append(leaves(store.deserialize_cdr(entry.data, entry.type_name), names))
    return topics


def definitions_in(file: Path) -> dict[str, str]:
    """Definition of each type that has a message in a file, read by the mcap library."""
    definitions = {}
    with file.open("rb") as stream, suppress(EndOfFile):
        for schema, _, _ in NonSeekingReader(stream).iter_messages(log_time_order=False):
            assert schema is not None
            definitions[schema.name] = schema.data.decode()
    return definitions


def leaves(value: Any, names: dict[str, list[str]]) -> list[Any]:
    if (type_name := getattr(value, "__msgtype__", None)) is not None:
        return [leaf for name in names[type_name] for leaf in leaves(getattr(value, name), names)]
    if isinstance(value, np.ndarray | list):
        return [leaf for part in value for leaf in leaves(part, names)]
    if isinstance(value, float | np.floating) and not math.isfinite(value):
        return ["NaN" if math.isnan(value) else f"{'-' * (value < 0)}Infinity"]
    return [value.item() if isinstance(value, np.generic) else value]


@pytest.mark.parametrize("mode", MODES)
def test_recorded_flight(script: Path, mode: str) -> None:
    (file,) = bag_files(SHORT_FLIGHT)
    found, known = read_with_node(script, mode, file), expected(file)
    assert len(found) > 20
    assert found == known
    assert len(found["/clock"]["messages"]) == 41
    assert found["/follower_1/range_bearing"]["messages"][0].count("leader") == 1


@pytest.mark.parametrize("mode", MODES)
def test_every_file_of_a_split_bag(script: Path, mode: str, tmp_path: Path) -> None:
    write_bag(tmp_path / "bag", 45, limits=SplitLimits(duration_s=1))
    files = bag_files(tmp_path / "bag")
    assert len(files) == 3
    counts = dict.fromkeys(TOPICS, 0)
    for file in files:
        found = read_with_node(script, mode, file)
        assert found == expected(file)
        for topic in TOPICS:
            counts[topic] += len(found[topic]["messages"])
    assert set(counts.values()) == {45}


def test_bag_of_a_killed_recorder(script: Path, tmp_path: Path) -> None:
    write_bag(tmp_path / "bag", 30, flush_every=5)
    file = tmp_path / "bag/bag_0.mcap"
    content = file.read_bytes()
    file.write_bytes(content[: len(content) // 2])
    known = expected(file)
    assert 10 < len(known["/clock"]["messages"]) < 30
    assert read_with_node(script, "streaming", file) == known, "without the index"
    assert recover_bag(tmp_path / "bag") is True
    for mode in MODES:
        assert read_with_node(script, mode, file) == known
