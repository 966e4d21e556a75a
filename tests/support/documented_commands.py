"""Where each command of README.md, CONTRIBUTING.md and docs/ is run, and which are not.

A new command belongs on a page of ``WALKED``, or has a row below. A row that no page needs any more is an error.
"""

from support.pages_with_commands import WORKSPACE

PAGES = [WORKSPACE / "README.md", WORKSPACE / "CONTRIBUTING.md", *sorted((WORKSPACE / "docs").glob("*.md"))]
WALKED = [WORKSPACE / f"docs/{name}.md" for name in ("tutorial", "how_to", "tuning")]
"""Every block of ``sh`` of these is run in a clean shell by tests/ros/test_tutorial.py, unless it is below."""
CONSOLE = WORKSPACE / "docs/ros2_command.md"
"""Its blocks are run by tests/ros/test_ros2_command.py, which compares the output."""

_BAG = "tests/ros/test_bag_command.py"
_NODES = "tests/ros/test_nodes.py::test_nodes_start_in_any_order"
_PARAMETERS = "tests/ros/test_parameters.py::test_parameters_have_types_bounds_and_descriptions"
_EXPORT = "tests/ros/test_path_export.py"
_FORMATION = "tests/ros/test_formation_change.py::test_accepted_requests_are_answered"
_RATES = "tests/closed_loop/test_control_rates.py::test_a_faster_controller_is_more_accurate"
_RECORDER = "tests/ros/test_recorder.py"
_REPORT = "tests/ros/test_report.py"
_REQUESTS = "tests/ros/test_requests.py::test_requests_are_answered"
_SHAPES = "tests/closed_loop/test_shapes.py::test_a_turn_and_a_change_of_formation"
_SWEEP = "tests/closed_loop/test_sweep_command.py::test_changed_keys_are_in_every_result"
_EXAMPLES = "tests/closed_loop/test_examples.py"

RUN_ELSEWHERE = {
    "make demo": "tests/ros/test_fly.py::test_scenario_is_equal_with_ros_without_ros_and_replayed",
    # It exits with 1, as diff does, when decisions differ.
    "scripts/replay.py runs/latest --controller config/controller/paper.yaml": "tests/ros/test_replay.py::test_command_line",
    # docs/library.md
    "examples/fifteen_lines.py": f"{_EXAMPLES}::test_fifteen_lines_fly_what_fly_in_process_flies",
    "examples/own_plant.py": f"{_EXAMPLES}::test_own_plant_ends_in_formation_where_it_started",
    "examples/own_cost_term.py": f"{_EXAMPLES}::test_own_cost_term_calms_the_vehicles",
    "examples/own_estimator.py": f"{_EXAMPLES}::test_own_estimator_is_better_than_raw_feedback",
    "examples/own_leader_reference.py": f"{_EXAMPLES}::test_own_leader_reference_is_flown",
    # docs/bags.md
    "scripts/record.py": f"{_RECORDER}::test_every_message_until_a_signal",
    "scripts/record.py --out DIR --topics /formation/state /leader/imu": f"{_RECORDER}::test_chosen_topics_and_wall_time",
    "scripts/record.py --max-bag-size 100000000 --max-bag-duration 60": f"{_RECORDER}::test_killed_recorder_of_a_split_bag",
    "ros2 run relform_bags record --out DIR": "tests/ros/test_environment.py::test_command_is_where_ros2_run_looks",
    ".venv/bin/ros2 bag record -a -o DIR": f"{_BAG}::test_played_messages_are_recorded",
    "scripts/record.py --recover DIR": f"{_RECORDER}::test_killed_recorder_loses_less_than_a_second",
    ".venv/bin/ros2 bag info runs/latest/bag": f"{_BAG}::test_info",
    ".venv/bin/ros2 bag play runs/latest/bag --rate 2 --start-offset 5": f"{_BAG}::test_played_messages_are_recorded",
    ".venv/bin/ros2 bag play runs/latest/bag --topics /leader/imu /clock --remap /leader/imu:=/imu --loop": f"{_BAG}::test_played_messages_are_recorded",
    # docs/report.md, docs/accuracy.md
    "scripts/report.py runs/latest": f"{_REPORT}::test_report_of_a_run_has_ending_and_figures",
    "scripts/report.py some/bag --out flight.html": f"{_REPORT}::test_bag_alone",
    "scripts/report.py runs/fifty": _SWEEP,
    "scripts/report.py runs/accuracy/nominal": _SWEEP,
    "scripts/report.py runs/first runs/second": f"{_REPORT}::test_two_recorded_flights_beside_each_other",
    "scripts/report.py tests/data/short_flight tests/data/older_flight --json comparison.json": f"{_REPORT}::test_two_recorded_flights_beside_each_other",
    "scripts/report.py runs/ablation:full runs/ablation:one_step-s3": "tests/unit/analysis/test_compared_sweep.py::test_flight_of_a_variant_is_the_one_that_the_sweep_flew",
    "scripts/replay.py tests/data/short_flight --set controller.weights.torque_per_n2_m2=20 --out runs/replayed": f"{_REPORT}::test_replay_beside_its_recording",
    "scripts/report.py tests/data/short_flight runs/replayed": f"{_REPORT}::test_replay_beside_its_recording",
    # docs/scenarios.md, docs/sweep.md
    "scripts/fly.py --scenario twelve": _SHAPES,
    "scripts/fly.py --scenario twelve --composed": _SHAPES,
    "scripts/fly.py --scenario paper --set controller=team_100hz": _RATES,
    "scripts/sweep.py --scenario twelve --runs 10 --out runs/twelve": _SWEEP,
    "scripts/sweep.py --scenario paper --variants rates --runs 20 --out runs/rates": _RATES,
    "scripts/sweep.py --scenario paper --runs 50 --out runs/fifty": _SWEEP,
    "scripts/sweep.py --scenario paper --runs 10 --variants ablation --set controller.horizon_steps=12 --out runs/ablation": _SWEEP,
    "scripts/sweep.py --scenario paper --runs 3 --grid controller.weights.torque_per_n2_m2=5,10,20 --out runs/torque": _SWEEP,
    "scripts/report.py runs/torque": _SWEEP,
    "scripts/sweep.py --scenario paper --variants tuning --runs 3 --out runs/tuning": _SWEEP,
    "scripts/bench.py --set controller=team_100hz": "tests/unit/analysis/test_bench.py::test_every_number_of_short_flights",
    "scripts/export_path.py runs/latest --out path.csv": f"{_EXPORT}::test_leader_of_our_bag",
    "scripts/export_path.py some/bag --topic /drone/odom --period 0.5 --start 12 --end 60 --out path.csv": f"{_EXPORT}::test_bag_of_others_becomes_a_motion",
    # docs/reliability.md
    "scripts/faults.py --case kill-fly:6": "tests/ros/test_faults.py::test_a_short_campaign_passes",
    # docs/nodes.md
    "ros2 run relform_sim quadrotor --ros-args -r __ns:=/leader --params-file config/nodes.yaml": _NODES,
    "ros2 run relform_sim quadrotor --ros-args -r __ns:=/follower_1 --params-file config/nodes.yaml": _NODES,
    "ros2 run relform_sim quadrotor --ros-args -r __ns:=/follower_2 --params-file config/nodes.yaml": _NODES,
    "ros2 run relform_controller controller --ros-args --params-file config/nodes.yaml": _NODES,
    "ros2 run relform_bags recorder --ros-args --params-file config/nodes.yaml -p output:=runs/by_hand": _NODES,
    "ros2 run relform_sim clock --ros-args --params-file config/nodes.yaml": _NODES,
    "ros2 run relform_bringup composed --ros-args --params-file config/nodes.yaml "
    "-p recorder:output:=runs/by_hand": "tests/ros/test_fly.py::test_composed_nodes_send_the_same_messages",
    "scripts/fly.py --scenario paper --set controller=team --idle": _REQUESTS,
    "ros2 service call /formation/controller/hover std_srvs/srv/Trigger": _REQUESTS,
    "ros2 run relform_bringup visualization --ros-args -p scenario:=config/scenarios/paper.yaml": "tests/ros/test_visualization.py::test_frames_are_one_tree",
    'ros2 service call /formation/set_formation relform_msgs/srv/SetFormation "{name: wide}"': _FORMATION,
    "ros2 service call /formation/set_formation relform_msgs/srv/SetFormation "
    """"{shape: '{kind: v, spacing_m: 1.2}', assign: true}\"""": _FORMATION,
    "ros2 param set /formation/controller weights.formation_per_m2 20.0": _PARAMETERS,
    'ros2 param set /formation/controller formation.follower_1 "[-1.5, -0.5, 0.0]"': _PARAMETERS,
    "ros2 param set /follower_1/quadrotor failsafe.descent_speed_m_s 0.5": _PARAMETERS,
    "ros2 param dump /formation/controller > tuned.yaml": "tests/ros/test_parameters.py::test_parameters_dumped_from_a_node_can_be_given_to_it",
    "ros2 run relform_controller controller --ros-args --params-file tuned.yaml": "tests/ros/test_parameters.py::test_parameters_dumped_from_a_node_can_be_given_to_it",
}
"""By command, without ``.venv/bin/python`` before it: the test that runs this program with these options,
mostly for a shorter time, and in a folder of its own."""

_AN_HOUR = "takes an hour or more"
_MINUTES = "takes minutes; a test runs the same command on less"
_SUDO = "needs sudo, once per machine"
_OTHER_MACHINE = "needs a second machine"
_NETWORK = (
    "needs pipx and a network; tests/unit/bringup/test_configuration_page.py checks files with the schemas"
)
_LAUNCH = "needs ROS from apt; tests/ros/test_launch.py runs it where that is installed"

NOT_RUN = {
    "sudo apt install gcc g++ cmake make git python3 python3-venv python3-dev": _SUDO,
    "sudo apt install git make gcc g++ cmake python3-venv python3-dev": _SUDO,
    "make test": "runs this test",
    "make format lint test": "runs this test",
    "make accuracy": _AN_HOUR,
    'make accuracy ARGS="--cases nominal bursts --seeds 10"': _MINUTES,
    "make paper": _MINUTES,
    "pipx run check-jsonschema --schemafile config/schema/scenario.json my_scenario.yaml": _NETWORK,
    "ssh -L 8080:localhost:8080 user@machine": _OTHER_MACHINE,
    "export ROS_DOMAIN_ID=42": _OTHER_MACHINE,
    "export ROS_AUTOMATIC_DISCOVERY_RANGE=SUBNET": _OTHER_MACHINE,
    "ros2 launch relform_bringup rviz.launch.py scenario:=paper": _LAUNCH,
    "ros2 launch relform_bringup flight.launch.py scenario:=paper output:=runs/launched visualize:=true": _LAUNCH,
}
"""By command, the reason."""
_PYTHON = ".venv/bin/python "


def is_listed(command: str) -> bool:
    """Whether another test than that of the walk runs a command, or none does."""
    return command.removeprefix(_PYTHON) in RUN_ELSEWHERE or command in NOT_RUN
