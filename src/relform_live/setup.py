from setuptools import find_packages, setup

NAME = "relform_live"

setup(
    name=NAME,
    version="0.1.0",
    description="Shows a flight in a browser, while it is flown or from its bag.",
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
            "bench_live = relform_live.bench:main",
            "live = relform_live.command:main",
        ]
    },
)
