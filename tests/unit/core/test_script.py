"""How scripts end."""

from relform_core.script import run_script


def test_exit_code_is_that_of_the_command() -> None:
    assert run_script(lambda: 7) == 7


def test_ctrl_c_is_no_traceback() -> None:
    def interrupted() -> int:
        raise KeyboardInterrupt

    assert run_script(interrupted) == 130
