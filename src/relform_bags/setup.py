from setuptools import find_packages, setup

NAME = "relform_bags"

setup(
    name=NAME,
    version="0.1.0",
    description="Writes, reads, recovers and plays rosbag2 bags: recorder, player and the verbs of ros2 bag.",
    maintainer="The relform developers",
    maintainer_email="maintainers@relform.dev",
    license="Apache-2.0",
    packages=find_packages(),
    package_data={"": ["py.typed"]},
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
    ],
    install_requires=["setuptools"],
    zip_safe=False,
    entry_points={
        "console_scripts": [
            "check_playback = relform_bags.check_command:main",
            "export_path = relform_bags.path_export.command:main",
            "foxglove = relform_bags.foxglove.command:main",
            "player = relform_bags.nodes.player:main",
            "record = relform_bags.record_command:main",
            "recorder = relform_bags.nodes.recorder:main",
        ],
        "relform_cli.commands": ["bag = relform_bags.ros2bag.command"],
    },
)
