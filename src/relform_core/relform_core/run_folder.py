"""The layout of a run folder: the names of the files that a flight leaves behind."""

from pathlib import Path

RUNS = Path("runs")
"""Folder of the runs that get no other folder, relative to the working directory."""
LATEST = "latest"
"""Link in ``RUNS`` to the newest run."""
CONFIG_FILE = "config.yaml"
BAG = "bag"
LOG = "log"
SUMMARY_FILE = "summary.json"
FIGURE_FILE = "flight.png"
REPORT_FILE = "report.html"
PAPER_FIGURES = "figures"


class RunFolder:
    """The files of one run; none of them has to exist."""

    def __init__(self, path: Path | str) -> None:
        path = self.path = Path(path)
        self.config = path / CONFIG_FILE
        """The effective configuration."""
        self.bag = path / BAG
        """Folder of the recorded bag."""
        self.log = path / LOG
        """Folder with the output of each node."""
        self.summary = path / SUMMARY_FILE
        self.figure = path / FIGURE_FILE
        self.report = path / REPORT_FILE
        self.paper_figures = path / PAPER_FIGURES
        """Folder of the report's figures as PNG and PDF."""

    def present(self) -> list[str]:
        """Names of the existing entries; folders end in a slash."""
        return sorted(f"{entry.name}/" if entry.is_dir() else entry.name for entry in self.path.iterdir())
