from setuptools import find_packages, setup

NAME = "relform_tools"

setup(
    name=NAME,
    version="0.1.0",
    description="Bags, metrics, figures and in-process runs of relform.",
    maintainer="The relform developers",
    maintainer_email="maintainers@relform.dev",
    license="Apache-2.0",
    packages=find_packages(),
    package_data={"": ["py.typed", "assets/*"]},
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
    ],
    install_requires=["setuptools"],
    zip_safe=False,
    entry_points={
        "console_scripts": [
            "player = relform_tools.player_node:main",
            "recorder = relform_tools.recorder_node:main",
        ],
        "relform_cli.commands": ["bag = relform_tools.bag_command"],
    },
)
