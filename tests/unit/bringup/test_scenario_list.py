"""``fly --list``."""

import pytest

from relform_bringup.command import main
from relform_core.config_files import installed_configs
from relform_core.load import load_scenario
from support.scenarios import CONFIG_FOLDER


def test_list_has_every_scenario_with_its_title(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["--list"])
    assert ended.value.code == 0
    lines = capsys.readouterr().out.splitlines()
    names = sorted(path.stem for path in (CONFIG_FOLDER / "scenarios").glob("*.yaml"))
    assert names == list(installed_configs("scenario"))
    assert [line.split()[0] for line in lines] == names
    for name, line in zip(names, lines, strict=True):
        assert line.split(maxsplit=1)[1] == load_scenario(name).config.title
    columns = {line.index(line.split(maxsplit=1)[1]) for line in lines}
    assert len(columns) == 1
