"""The path of a vehicle in a bag, ours or one of others, as a file that a scenario flies."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin, Writer

from relform_analysis.flight.from_bag import read_flight_log
from relform_bags.path_export.command import main
from relform_core.path_file import read_path
from support.bags import typestore
from support.scenarios import paper_scenario

SHORT_FLIGHT = Path(__file__).parents[1] / "data/short_flight"
STEP_NS = 100_000_000


def columns(path: Path) -> np.ndarray:
    """Time, x, y, z, yaw in degrees, shape (sample, 5)."""
    found = read_path(path)
    return np.column_stack([found["times_s"], found["points_m"], found["yaws_deg"]])


def test_leader_of_our_bag(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "leader.csv"
    assert main([str(SHORT_FLIGHT), "--out", str(out), "--start", "0.5", "--end", "1.7"]) == 0
    assert capsys.readouterr().out == f"{out}: 7 samples, 1.20 s\n"
    samples = columns(out)
    truth = read_flight_log(SHORT_FLIGHT).p_NB_N[:, 0]
    np.testing.assert_allclose(samples[:, 0], np.arange(7) * 0.2, atol=1e-9)
    np.testing.assert_allclose(samples[[0, -1], 1:4], truth[[10, 34]], atol=1e-4)
    np.testing.assert_allclose(samples[:, 1:4], truth[10:35:4], atol=0.02)
    np.testing.assert_allclose(samples[:, 4], 30.0, atol=3.0)


@pytest.mark.parametrize("kind", ["Path", "PoseStamped", "PoseWithCovarianceStamped", "Odometry"])
def test_bag_of_others_becomes_a_motion(kind: str, tmp_path: Path) -> None:
    """4 m in 10 s, at a yaw that turns from 170 to 230 degrees."""
    out = tmp_path / "path.csv"
    write_foreign_bag(tmp_path / "bag", kind)
    assert main([str(tmp_path / "bag"), "--topic", "/drone/pose", "--period", "1", "--out", str(out)]) == 0
    samples = columns(out)
    t = np.arange(11.0)
    np.testing.assert_allclose(
        samples, np.column_stack([t, 5.0 + 0.4 * t, 0.0 * t - 3.0, 2.0 + 0.1 * t, 170.0 + 6.0 * t]), atol=1e-3
    )
    motion = f"{{kind: path, file: {out}}}"
    config = paper_scenario("phases.1.duration_s=11", f"phases.1.motion={motion}").config
    assert config.phases[1].motion.kind == "path"


@pytest.mark.parametrize(
    ("arguments", "problem"),
    [
        (
            ["--topic", "/leader/imu"],
            "no poses on topic '/leader/imu'; topics with poses are /follower_1/ground_truth, "
            "/follower_2/ground_truth, /leader/ground_truth, /leader/localization",
        ),
        (
            ["--start", "1.9", "--end", "1.95"],
            "/leader/ground_truth has 2 poses from 1.9 s to 1.95 s, less than one --period of 0.2 s; "
            "its poses end at 2.00 s",
        ),
    ],
)
def test_bag_without_such_poses(
    arguments: list[str], problem: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "path.csv"
    assert main([str(SHORT_FLIGHT), *arguments, "--out", str(out)]) == 2
    assert capsys.readouterr().err == f"error: {SHORT_FLIGHT}: {problem}\n"
    assert not out.exists()


def write_foreign_bag(folder: Path, kind: str) -> None:
    """Poses of a drone at 10 Hz, recorded by rosbags; a Path grows with each message."""
    types = typestore().types
    name = f"{'nav_msgs' if kind in ('Path', 'Odometry') else 'geometry_msgs'}/msg/{kind}"
    poses = []
    with Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        connection = writer.add_connection("/drone/pose", name, typestore=typestore())
        for index in range(101):
            stamp = types["builtin_interfaces/msg/Time"](
                1_700_000_000 + index // 10, index % 10 * 100_000_000
            )
            header = types["std_msgs/msg/Header"](stamp=stamp, frame_id="odom")
            pose = pose_after(0.1 * index)
            poses.append(types["geometry_msgs/msg/PoseStamped"](header=header, pose=pose))
            uncertain = types["geometry_msgs/msg/PoseWithCovariance"](pose=pose, covariance=np.zeros(36))
            match kind:
                case "Path":
                    message = types[name](header=header, poses=list(poses))
                case "PoseStamped":
                    message = poses[-1]
                case "PoseWithCovarianceStamped":
                    message = types[name](header=header, pose=uncertain)
                case _:
                    message = types[name](header, "drone", uncertain, unknown_twist())
            writer.write(connection, index, typestore().serialize_cdr(message, name))


def unknown_twist() -> Any:
    types = typestore().types
    zero = types["geometry_msgs/msg/Vector3"](0.0, 0.0, 0.0)
    twist = types["geometry_msgs/msg/Twist"](linear=zero, angular=zero)
    return types["geometry_msgs/msg/TwistWithCovariance"](twist=twist, covariance=np.zeros(36))


def pose_after(time: float) -> Any:
    types = typestore().types
    half = 0.5 * np.radians(170.0 + 6.0 * time)
    return types["geometry_msgs/msg/Pose"](
        position=types["geometry_msgs/msg/Point"](5.0 + 0.4 * time, -3.0, 2.0 + 0.1 * time),
        orientation=types["geometry_msgs/msg/Quaternion"](0.0, 0.0, np.sin(half), np.cos(half)),
    )
