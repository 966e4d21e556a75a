"""Range and bearing: noise, limits, sectors, poles, outliers and dropouts of single targets."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from relform_core.events_config import Occlusion, Outliers
from relform_core.load import load_scenario
from relform_core.measurements import Odometry
from relform_core.sensors.range_bearing import RangeBearing, RangeBearings, Sector
from relform_sensors.range_bearing import UNKNOWN_ANGLE_STD, RangeBearingSensor

CONFIG = load_scenario(Path(__file__).parents[3] / "config/scenarios/paper.yaml").config.sensors.range_bearing
ATTITUDE = Rotation.from_euler("ZYX", [2.2, -0.4, 0.6])
P_NB_N = np.array([3.0, -4.0, 5.0])
ZEROS = np.zeros((6, 6))


def direction(azimuth: float, elevation: float) -> Any:
    """Eq. CameraRange1 for range 1."""
    return np.array(
        [
            math.cos(elevation) * math.cos(azimuth),
            math.cos(elevation) * math.sin(azimuth),
            math.sin(elevation),
        ]
    )


def position(measured: RangeBearing) -> Any:
    return measured.range * direction(measured.azimuth, measured.elevation)


def odometry(p_NB_N: Any, time: float = 2.0) -> Odometry:
    return Odometry(round(time * 1e9), p_NB_N, ATTITUDE.as_quat(), np.zeros(3), np.zeros(3), ZEROS, ZEROS)


class Scene:
    """An observer with one target at a known place in its body frame."""

    def __init__(self, *, outliers: tuple[Outliers, ...] = (), seed: int = 0, **changes: Any) -> None:
        self.sensor = RangeBearingSensor(
            CONFIG.model_copy(update=changes), np.random.default_rng(seed), "me", ["other"], outliers
        )

    def all(
        self, distance: float, azimuth_deg: float, elevation_deg: float, time: float = 2.0
    ) -> RangeBearings:
        p_BT_B = distance * direction(math.radians(azimuth_deg), math.radians(elevation_deg))
        target = odometry(P_NB_N + ATTITUDE.apply(p_BT_B), time)
        return self.sensor.read({"me": odometry(P_NB_N, time), "other": target})

    def one(self, *where: float) -> RangeBearing | None:
        return self.all(*where).by_target.get("other")

    def sees(self, *where: float) -> bool:
        return self.one(*where) is not None


def everywhere() -> tuple[Sector, ...]:
    return (make_sector(-180.0, 180.0, -90.0, 90.0),)


def make_sector(azimuth_min: float, azimuth_max: float, elevation_min: float, elevation_max: float) -> Sector:
    return Sector(
        azimuth_min_deg=azimuth_min,
        azimuth_max_deg=azimuth_max,
        elevation_min_deg=elevation_min,
        elevation_max_deg=elevation_max,
    )


def test_noise_is_equal_along_the_line_of_sight_and_across_it() -> None:
    scene, n = Scene(), 4000
    distance, azimuth, elevation = 1.3, math.radians(130.0), math.radians(40.0)
    line = direction(azimuth, elevation)
    left = np.array([-math.sin(azimuth), math.cos(azimuth), 0.0])
    axes = np.array([line, left, np.cross(line, left)])
    errors = []
    for _ in range(n):
        measured = scene.one(distance, 130.0, 40.0)
        assert measured is not None
        errors.append(axes @ (position(measured) - distance * line))
    assert np.std(errors, axis=0) == pytest.approx([0.025] * 3, rel=0.05)
    assert (
        np.abs(np.mean(errors, axis=0)).max() < 4.5 * 0.025 / math.sqrt(n) + 0.0005
    )  # spherical: a bent bias
    assert np.abs(np.corrcoef(np.transpose(errors)) - np.eye(3)).max() < 0.07


def test_covariance_is_that_of_the_model() -> None:
    measured = Scene().one(1.3, 130.0, 40.0)
    assert measured is not None
    stds = [0.025, 0.025 / (measured.range * math.cos(measured.elevation)), 0.025 / measured.range]
    assert measured.covariance == pytest.approx(np.diag(np.square(stds)))


@pytest.mark.parametrize("elevation_deg", [90.0, -90.0, 89.99])
def test_at_a_pole_the_azimuth_is_unknown_and_all_numbers_are_finite(elevation_deg: float) -> None:
    scene = Scene(sectors=everywhere())
    for _ in range(50):
        measured = scene.one(1.5, 20.0, elevation_deg)
        assert measured is not None
        assert -math.pi / 2.0 <= measured.elevation <= math.pi / 2.0
        assert -math.pi < measured.azimuth <= math.pi
        assert math.sqrt(measured.covariance[1, 1]) <= UNKNOWN_ANGLE_STD
        assert position(measured) == pytest.approx(
            1.5 * direction(0.0, math.radians(elevation_deg)), abs=0.15
        )


def test_a_target_at_the_same_place_gives_finite_numbers() -> None:
    measured = Scene(sectors=everywhere(), range_min=0.0).one(0.0, 0.0, 0.0)
    assert measured is not None
    assert measured.range >= 0.0
    assert np.isfinite(measured.covariance).all()


def test_azimuth_of_a_target_behind_stays_in_its_interval() -> None:
    scene = Scene()
    azimuths = [measured.azimuth for _ in range(200) if (measured := scene.one(1.0, 180.0, 10.0))]
    assert len(azimuths) == 200
    assert min(azimuths) < -3.0  # the noise carries it to both sides
    assert max(azimuths) > 3.0
    assert all(-math.pi < azimuth <= math.pi for azimuth in azimuths)


@pytest.mark.parametrize(("distance", "seen"), [(0.09, False), (0.11, True), (9.99, True), (10.01, False)])
def test_range_limits_apply_to_the_true_range(distance: float, seen: bool) -> None:
    scene = Scene()
    assert all(scene.sees(distance, 15.0, 5.0) == seen for _ in range(20))


@pytest.mark.parametrize(
    ("azimuth_deg", "elevation_deg", "seen"),
    [(0, 0, True), (179, 59, True), (-179, -59, True), (90, 61, False), (-90, -61, False)],
)
def test_default_field_of_view(azimuth_deg: float, elevation_deg: float, seen: bool) -> None:
    assert Scene().sees(2.0, azimuth_deg, elevation_deg) == seen


@pytest.mark.parametrize(
    ("azimuth_deg", "elevation_deg", "seen"),
    [
        # a forward sector and one that spans the backward direction, from 150 over 180 to -120 deg
        (0, 0, True), (31, 0, False), (-29, 9, True), (-29, 11, False), (149, 0, False), (151, 0, True),
        (180, 25, True), (-179, -25, True), (-121, 0, True), (-119, 0, False), (90, 0, False),
    ],
)  # fmt: skip
def test_sectors_are_joined_and_may_span_the_backward_direction(
    azimuth_deg: float, elevation_deg: float, seen: bool
) -> None:
    sectors = (make_sector(-30.0, 30.0, -10.0, 10.0), make_sector(150.0, -120.0, -30.0, 30.0))
    assert Scene(sectors=sectors).sees(2.0, azimuth_deg, elevation_deg) == seen


def test_out_of_view_the_message_is_empty_but_stamped() -> None:
    message = Scene().all(20.0, 0.0, 0.0, time=3.5)
    assert message.by_target == {}
    assert message.stamp_ns == 3_500_000_000


def make_outliers(probability: float = 1.0, start: float = 1.0, end: float = 3.0) -> Outliers:
    return Outliers(
        kind="outliers",
        start_s=start,
        end_s=end,
        target="me",
        probability=probability,
        range_std_m=1.0,
        bearing_std_deg=50.0,
    )


def test_outliers_replace_the_specified_share_of_measurements_while_they_act() -> None:
    clean, hit = Scene(), Scene(outliers=(make_outliers(0.3),))
    n_changed = {0.5: 0, 2.0: 0, 3.0: 0}
    for time in n_changed:
        for _ in range(1000):
            a = clean.all(1.5, 100.0, -20.0, time).by_target["other"]
            b = hit.all(1.5, 100.0, -20.0, time).by_target["other"]
            n_changed[time] += a.range != b.range
    assert n_changed == {0.5: 0, 2.0: pytest.approx(300, abs=60), 3.0: 0}


def test_outliers_are_well_formed_and_keep_the_usual_covariance() -> None:
    scene = Scene(outliers=(make_outliers(),))
    measurements = [measured for _ in range(2000) if (measured := scene.one(1.5, 100.0, -20.0))]
    assert len(measurements) == 2000
    assert all(measured.range > 0.0 for measured in measurements)
    assert all(abs(measured.elevation) <= math.pi / 2.0 for measured in measurements)
    assert all(-math.pi < measured.azimuth <= math.pi for measured in measurements)
    errors = np.abs([measured.range - 1.5 for measured in measurements])
    assert np.median(errors) == pytest.approx(0.67, abs=0.08)
    azimuth_errors = [math.remainder(m.azimuth - math.radians(100.0), math.tau) for m in measurements]
    assert np.median(np.abs(azimuth_errors)) > 0.4
    believed = [measured.covariance[0, 0] for measured in measurements]
    assert max(believed) == min(believed) == pytest.approx(0.025**2)


def test_azimuth_turns_by_half_a_circle_over_a_pole() -> None:
    scene = Scene(sectors=everywhere(), outliers=(make_outliers(),))
    measurements = [measured for _ in range(1000) if (measured := scene.one(1.5, 100.0, 80.0))]
    assert len(measurements) == 1000
    azimuth_errors = [abs(math.remainder(m.azimuth - math.radians(100.0), math.tau)) for m in measurements]
    # A normal error of 50 deg exceeds 90 deg in 7%; 80 deg plus such an error exceeds 90 deg in 42%.
    assert np.mean(np.array(azimuth_errors) > math.pi / 2.0) == pytest.approx(0.43, abs=0.06)


def test_of_several_outlier_events_the_first_acts() -> None:
    harmless, certain = make_outliers(0.0), make_outliers(1.0)
    ranges = [
        Scene(outliers=events).all(1.5, 100.0, -20.0).by_target["other"].range
        for events in ((), (harmless, certain), (certain, harmless))
    ]
    assert ranges[0] == ranges[1] != ranges[2]


def test_targets_drop_out_with_the_specified_probability() -> None:
    scene = Scene(dropout_probability=0.2)
    seen = sum(scene.sees(1.5, 100.0, -20.0) for _ in range(2000))
    assert seen == pytest.approx(1600, abs=90)


def test_an_occlusion_hides_one_vehicle_and_changes_nothing_else() -> None:
    hidden = Occlusion(kind="occlusion", target="me", hidden="second", start_s=1.0, end_s=2.5)
    free, occluded = (
        RangeBearingSensor(CONFIG, np.random.default_rng(3), "me", ["first", "second", "third"], (), events)
        for events in ((), (hidden,))
    )
    for time, names in ((0.9, {"first", "second", "third"}), (1.0, {"first", "third"}), (2.5, {"second"})):
        offsets = {"first": (1.0, 0.5, 0.2), "second": (-1.0, 0.4, -0.3), "third": (0.2, -1.5, 0.1)}
        truth = {"me": odometry(P_NB_N, time)} | {
            name: odometry(P_NB_N + ATTITUDE.apply(offset), time) for name, offset in offsets.items()
        }
        all_of_them, seen = (sensor.read(truth).by_target for sensor in (free, occluded))
        assert names <= set(seen)
        assert ("second" in seen) == ("second" in names)
        for name, measured in seen.items():
            assert measured.range == all_of_them[name].range
