from pathlib import Path

from setuptools import find_packages, setup

NAME = "relform_bringup"
# colcon --symlink-install runs this file through a link in its build folder; the sources are where it points.
HERE = Path(__file__).resolve().parent


def shared_files() -> list[tuple[str, list[str]]]:
    """The files for share/, in the same folders; config/ is a link to the folder at the top."""
    tops = [HERE / name for name in ("config", "launch", "rviz")]
    folders = [*tops, *sorted(path for path in tops[0].iterdir() if path.is_dir())]
    return [
        (
            f"share/{NAME}/{folder.relative_to(HERE)}",
            [str(path.relative_to(HERE)) for path in sorted(folder.iterdir()) if path.is_file()],
        )
        for folder in folders
    ]


setup(
    name=NAME,
    version="0.1.0",
    description="Starts and supervises the nodes of a flight; installs the configuration files.",
    maintainer="The relform developers",
    maintainer_email="maintainers@relform.dev",
    license="Apache-2.0",
    packages=find_packages(),
    package_data={"": ["py.typed", "*.c"]},
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
        *shared_files(),
    ],
    install_requires=["setuptools"],
    zip_safe=False,
    entry_points={
        "console_scripts": [
            "bench_real_time = relform_bringup.real_time_bench:main",
            "bench_memory = relform_bringup.memory_over_time:main",
            "bench_ros = relform_bringup.cpu_per_step:main",
            "composed = relform_bringup.nodes.composed:main",
            "fly = relform_bringup.command:main",
            "visualization = relform_bringup.nodes.visualization:main",
        ]
    },
)
