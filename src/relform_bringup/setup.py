from setuptools import find_packages, setup

NAME = "relform_bringup"

setup(
    name=NAME,
    version="0.1.0",
    description="Starts and supervises the nodes of a flight; installs the configuration files.",
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
