"""Where the configuration of a recorded flight comes from: its bag, a file beside the bag, or the user."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from relform_bags.reader import read_attachments
from relform_core.errors import BagError, ConfigError
from relform_core.load import LoadedScenario, load_scenario, load_scenario_text
from relform_core.names import CONFIG_ATTACHMENT
from relform_core.run_folder import CONFIG_FILE


@dataclass(frozen=True)
class BagConfiguration:
    """The configuration of a recorded flight, as a file or as the text that is attached to its bag."""

    bag: Path
    """The bag's file, or its folder if it is split."""
    source: Path | str | None
    """Path or plain name of a scenario; None: the text is used."""
    text: str = ""

    def load(self, overrides: Sequence[str] = ()) -> LoadedScenario:
        """The scenario, with some keys changed.

        Raises:
            BagError: the configuration is not usable.
            ConfigError: an override is not.
        """
        try:
            scenario = self._load(())
        except ConfigError as error:
            raise BagError(str(error).splitlines()[0]) from None
        return self._load(overrides) if overrides else scenario

    def _load(self, overrides: Sequence[str]) -> LoadedScenario:
        if self.source is not None:
            return load_scenario(self.source, overrides)
        origin = f"{self.bag}: its attachment {CONFIG_ATTACHMENT}"
        return load_scenario_text(self.text, origin, overrides, names_files=False)


def find_configuration(bag: Path | str, given: Path | str | None = None) -> BagConfiguration:
    """The given configuration, else the bag's attachment, else a ``config.yaml`` beside the bag.

    Args:
        bag: the bag's file, or its folder if it is split.
        given: path or plain name of a scenario.
    Raises:
        BagError: no configuration is found, or the bag cannot be read.
    """
    bag = Path(bag)
    if given is not None:
        return BagConfiguration(bag, given)
    if (text := read_attachments(bag).get(CONFIG_ATTACHMENT)) is not None:
        return BagConfiguration(bag, None, text)
    folder = bag if bag.is_dir() else bag.parent
    for candidate in (folder / CONFIG_FILE, folder.absolute().parent / CONFIG_FILE):
        if candidate.is_file():
            return BagConfiguration(bag, candidate)
    raise BagError(
        f"{bag}: no configuration of the flight: the bag has no attachment {CONFIG_ATTACHMENT}, and neither "
        f"its folder nor the one above holds a {CONFIG_FILE}; name the scenario with --config FILE"
    )
