from setuptools import find_packages, setup

NAME = "relform_cli"

# There is no console script: a stock ROS has its own ros2. Where none is, set-up adds one that runs this.
setup(
    name=NAME,
    version="0.1.0",
    description="A ros2 command for environments that have none; where ros2cli is installed, it is not used.",
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
)
