from setuptools import find_packages, setup

NAME = "relform_analysis"

setup(
    name=NAME,
    version="0.1.0",
    description="Flights without ROS, metrics, replays, sweeps, plots, reports and benchmarks of relform.",
    maintainer="The relform developers",
    maintainer_email="maintainers@relform.dev",
    license="Apache-2.0",
    packages=find_packages(),
    package_data={"": ["py.typed", "assets/*", "assets/uplot/*"]},
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
    ],
    install_requires=["setuptools"],
    zip_safe=False,
    entry_points={
        "console_scripts": [
            "accuracy = relform_analysis.accuracy.command:main",
            "bench = relform_analysis.bench.flight:main",
            "bench_solver = relform_analysis.bench.solver:main",
            "bound = relform_analysis.judges.command:main",
            "constraints = relform_analysis.plots.constraint_scenarios:main",
            "formation_changes = relform_analysis.plots.formation_changes:main",
            "motions = relform_analysis.plots.motions:main",
            "paper = relform_analysis.evaluation.command:main",
            "replay = relform_analysis.replay.command:main",
            "report = relform_analysis.report.command:main",
            "shapes = relform_analysis.plots.shapes:main",
            "sweep = relform_analysis.sweep.command:main",
        ]
    },
)
