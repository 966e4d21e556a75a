from setuptools import find_packages, setup

NAME = "relform_sim"

setup(
    name=NAME,
    version="0.1.0",
    description="Simulated quadrotors, one node per vehicle, and the clock that steps them.",
    maintainer="The relform developers",
    maintainer_email="maintainers@relform.dev",
    license="Apache-2.0",
    packages=find_packages(),
    package_data={"": ["py.typed", "*.c"]},
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
    ],
    install_requires=["setuptools"],
    zip_safe=False,
    entry_points={
        "console_scripts": [
            "quadrotor = relform_sim.nodes.quadrotor:main",
            "clock = relform_sim.nodes.clock:main",
        ]
    },
)
