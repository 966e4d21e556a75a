"""Complete a bag that its recorder did not close: cut off a torn record, then write the index.

MCAP records can be read without the index, which only repeats where they are. Everything up to the last
finished chunk is kept, in place.
"""

from pathlib import Path

from relform_bags.metadata import METADATA_FILE, to_yaml, write_metadata_yaml
from relform_bags.reader import bag_files
from relform_bags.reserve import RESERVE_FILE
from relform_bags.scan import FileScan, information_of
from relform_core.errors import BagError


def recover_bag(path: Path | str) -> bool:
    """Complete every file of a bag that was not closed, and its metadata.yaml.

    Args:
        path: the bag's folder, a file in it or the folder of a run.
    Returns:
        False if the bag was complete.
    Raises:
        BagError: the bag does not exist, has no good record, or cannot be written.
    """
    path = Path(path)
    files = bag_files(path.parent if path.is_file() else path)
    folder = files[0].parent
    scans = [_complete(file) for file in files]
    if all(scan.was_complete for scan in scans) and (folder / METADATA_FILE).exists():
        return False
    try:
        write_metadata_yaml(folder, to_yaml(information_of(scans)))
        (folder / RESERVE_FILE).unlink(missing_ok=True)
        for file in set(folder.glob("*.mcap")).difference(files):
            file.unlink()  # shorter than the first bytes of an MCAP file
    except OSError as error:
        raise BagError(f"{folder}: cannot be recovered: {error.strerror}") from None
    return True


def _complete(path: Path) -> FileScan:
    """Write the index of a file if it has none."""
    try:
        with path.open("r+b") as file:
            scan = FileScan(file, path)
            if scan.empty:
                raise BagError(f"{path}: cannot be recovered: it has no complete record")
            if not scan.was_complete:
                scan.write_index(file)
    except OSError as error:
        raise BagError(f"{path}: cannot be recovered: {error.strerror}") from None
    return scan
