from setuptools import find_packages, setup

NAME = "relform_controller"

setup(
    name=NAME,
    version="0.1.0",
    description="Centralised formation NMPC with real-time iteration, and the node that runs it.",
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
            "controller = relform_controller.nodes.controller:main",
            "leader = relform_controller.nodes.controller:main_of_leader",
        ]
    },
)
