from setuptools import find_packages, setup

NAME = "relform_ros"

setup(
    name=NAME,
    version="0.1.0",
    description="The ROS side of relform: conversions, topics, pacing, parameters and the start of nodes.",
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
