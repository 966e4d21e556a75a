"""Finish a bag whose recorder could not: cut off what is torn, then write the index that readers want.

MCAP is made for this: records stand on their own, the index at the end only repeats where they are.
Everything up to the last finished chunk is kept, in place.
"""

from pathlib import Path

from relform_bags.metadata import METADATA_FILE, to_yaml, write_metadata_yaml
from relform_bags.reader import bag_files
from relform_bags.reserve import RESERVE_FILE
from relform_bags.scan import FileScan, information_of
from relform_core.errors import BagError


def recover_bag(path: Path) -> bool:
    """Make a complete bag of one that was not closed, every file of it.

    Args:
        path: the bag's folder, a file in it or the folder of a run.
    Returns:
        False if there was nothing to do.
    Raises:
        BagError: no bag is there, or it cannot be written.
    """
    files = bag_files(path.parent if path.is_file() else path)
    folder = files[0].parent
    scans = [_complete(file) for file in files]
    if all(scan.was_complete for scan in scans) and (folder / METADATA_FILE).exists():
        return False
    try:
        write_metadata_yaml(folder, to_yaml(information_of(scans)))
        (folder / RESERVE_FILE).unlink(missing_ok=True)
        for file in set(folder.glob("*.mcap")).difference(files):
            file.unlink()  # it was only begun
    except OSError as error:
        raise BagError(f"{folder}: cannot be recovered: {error.strerror}") from None
    return True


def _complete(path: Path) -> FileScan:
    """Write the index of a file if it has none."""
    try:
        with path.open("r+b") as file:
            scan = FileScan(file, path)
            if scan.empty:
                raise BagError(f"{path}: cannot be recovered: it holds nothing")
            if not scan.was_complete:
                scan.write_index(file)
    except OSError as error:
        raise BagError(f"{path}: cannot be recovered: {error.strerror}") from None
    return scan
