from setuptools import find_packages, setup

NAME = "relform_core"

setup(
    name=NAME,
    version="0.1.0",
    description="Types, errors, units and configuration schema shared by all of relform; free of ROS.",
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
