"""Compiled C code: where it is kept, when it is compiled, by several processes at once, and errors."""

import ctypes
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from relform_core import c_library
from relform_core.c_library import COMPILER_FLAGS, NoCompilerError, shared_library
from relform_core.errors import RelformError
from support.compilers import Compiler, use_compiler

SOURCE = "long product(long a, long b) { return a * b; }\n"


@pytest.fixture
def compiler(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Compiler:
    """With an empty cache, and a working folder that should stay empty."""
    compiler = Compiler(tmp_path)
    use_compiler(monkeypatch, tmp_path, compiler)
    (tmp_path / "working").mkdir()
    (tmp_path / "temporary").mkdir()
    monkeypatch.chdir(tmp_path / "working")
    monkeypatch.setenv("TMPDIR", str(tmp_path / "temporary"))
    return compiler


def kept(tmp_path: Path) -> list[Path]:
    return list((tmp_path / "cache/relform").iterdir())


def test_the_library_has_the_compiled_code(compiler: Compiler) -> None:
    assert ctypes.CDLL(str(shared_library(SOURCE))).product(6, -7) == -42


def test_the_same_code_is_compiled_once(compiler: Compiler, tmp_path: Path) -> None:
    library = shared_library(SOURCE)
    stamp = library.stat().st_mtime_ns
    assert shared_library(SOURCE) == library
    assert compiler.count == 1
    assert kept(tmp_path) == [library]
    assert library.stat().st_mtime_ns == stamp


def test_other_code_flags_compilers_and_versions_are_compiled_and_the_first_library_kept(
    compiler: Compiler, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    first = shared_library(SOURCE)
    found = [first, shared_library(f"{SOURCE}\n"), shared_library(SOURCE, (*COMPILER_FLAGS, "-O1"))]
    script = compiler.path.read_text()
    compiler.path.write_text(script.replace("exec", '[ "$1" != --version ] || echo patched\nexec'))
    found.append(shared_library(SOURCE))
    compiler.path.write_text(script)
    monkeypatch.setenv("CC", str(shutil.copy(compiler.path, tmp_path / "other-cc")))
    found.append(shared_library(SOURCE))
    monkeypatch.setenv("CC", str(compiler.path))
    assert compiler.count == 5
    assert sorted(found) == sorted(kept(tmp_path))
    assert shared_library(SOURCE) == first
    assert compiler.count == 5


def test_another_processor_needs_another_library(compiler: Compiler, monkeypatch: pytest.MonkeyPatch) -> None:
    """Home folders are shared between machines, and the code is compiled for one of them."""
    first = shared_library(SOURCE)
    monkeypatch.setattr(c_library, "_cpu", lambda: "another processor")
    assert shared_library(SOURCE) != first
    assert compiler.count == 2


def test_several_processes_that_need_a_library_at_once(compiler: Compiler, tmp_path: Path) -> None:
    """All of them compile it, because none is done before the last one begins; one library is kept."""
    n_processes = 4
    compiler.compile_together(n_processes)
    program = (
        "import ctypes\n"
        "from relform_core.c_library import shared_library\n"
        f"print(ctypes.CDLL(str(shared_library({SOURCE!r}))).product(6, -7))\n"
    )
    processes = [
        subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True)
        for _ in range(n_processes)
    ]
    assert [process.communicate(timeout=60)[0] for process in processes] == ["-42\n"] * n_processes
    assert compiler.count == n_processes
    assert len(kept(tmp_path)) == 1


def test_nothing_is_left_outside_the_cache(compiler: Compiler, tmp_path: Path) -> None:
    shared_library(SOURCE)
    assert compiler.count == 1
    assert not list((tmp_path / "working").iterdir())
    assert not list((tmp_path / "temporary").iterdir())


def test_the_cache_of_the_user_is_the_default(
    compiler: Compiler, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("XDG_CACHE_HOME")
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    assert shared_library(SOURCE).parent == tmp_path / "home/.cache/relform"


def test_without_a_compiler_there_is_one_warning_and_an_error_each_time(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.delenv("CC", raising=False)
    message = r"no C compiler found: install one \(apt install gcc\) or name it in the variable CC"
    program = (
        "from relform_core.c_library import NoCompilerError, shared_library\n"
        "for source in 'ab':\n"
        "    try:\n"
        "        shared_library(source)\n"
        "    except NoCompilerError as error:\n"
        "        print(error)\n"
    )
    outcome = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True, timeout=60
    )
    assert outcome.stdout.count("no C compiler found") == 2
    assert outcome.stderr.count("RuntimeWarning: no C compiler found") == 1
    with pytest.warns(RuntimeWarning, match=message), pytest.raises(NoCompilerError, match=message):
        shared_library(SOURCE)


def message_of_failure() -> str:
    with pytest.raises(RelformError) as caught:
        shared_library(SOURCE)
    (line,) = str(caught.value).splitlines()
    return line


def test_a_compiler_that_fails(compiler: Compiler, tmp_path: Path) -> None:
    compiler.path.write_text("#!/bin/sh\necho 'kernels.c:1: error: no such\n  register' >&2\nexit 1\n")
    assert message_of_failure() == (
        f"{compiler.path} cannot compile the kernels: kernels.c:1: error: no such register"
    )
    assert not (tmp_path / "cache").exists()


@pytest.mark.parametrize("cache", ["a-file", "/proc/relform", "n" * 300], ids=["file", "proc", "long"])
def test_a_cache_that_cannot_be_written(
    compiler: Compiler, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, cache: str
) -> None:
    (tmp_path / "a-file").write_text("")
    folder = tmp_path / cache
    monkeypatch.setenv("XDG_CACHE_HOME", str(folder))
    with pytest.warns(RuntimeWarning, match="cannot be written") as warned:
        library = shared_library(SOURCE)
    (line,) = str(warned[0].message).splitlines()
    assert len(warned) == 1
    assert line.startswith(f"{folder}/relform/kernels-")
    assert line.endswith("; set XDG_CACHE_HOME to another folder")
    assert ctypes.CDLL(str(library)).product(6, -7) == -42
    assert library.parent.name.startswith("relform-")


def test_what_is_kept_for_a_process_is_gone_at_its_end(
    compiler: Compiler, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", "/proc/relform")
    program = f"from relform_core.c_library import shared_library\nprint(shared_library({SOURCE!r}))\n"
    run = subprocess.run([sys.executable, "-W", "ignore", "-c", program], capture_output=True, text=True)
    assert Path(run.stdout.strip()).parent.parent == tmp_path / "temporary"
    assert not list((tmp_path / "temporary").iterdir())


def test_without_any_folder_nothing_compiled_is_used(
    compiler: Compiler, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As without a compiler: all that is compiled exists without as well."""
    monkeypatch.setenv("XDG_CACHE_HOME", "/proc/relform")
    monkeypatch.setattr(c_library, "_temporary_folder", lambda: Path("/proc/relform"))
    with (
        pytest.warns(RuntimeWarning, match="cannot be written"),
        pytest.raises(NoCompilerError, match="compiled code cannot be kept or loaded anywhere"),
    ):
        shared_library(SOURCE)


def cut_off(content: bytes) -> bytes:
    return content[:1000]


def with_another_bit(content: bytes) -> bytes:
    middle = len(content) // 2
    return content[:middle] + bytes([content[middle] ^ 4]) + content[middle + 1 :]


def empty(content: bytes) -> bytes:
    return b""


def another(content: bytes) -> bytes:
    """One that is whole, as if it came from another machine."""
    return shared_library("long product(long a, long b) { return 0; }\n").read_bytes()


@pytest.mark.parametrize("damage", [cut_off, with_another_bit, empty, another])
def test_a_library_that_is_not_the_one_that_was_compiled_is_not_loaded(
    compiler: Compiler, damage: Callable[[bytes], bytes]
) -> None:
    """Cut off, it would end the process by a signal when it is used."""
    library = shared_library(SOURCE)
    content = damage(library.read_bytes())
    library.unlink()  # this process has loaded it
    library.write_bytes(content)
    before = compiler.count
    with pytest.warns(RuntimeWarning, match="damaged, or made for another machine: it is compiled again"):
        assert shared_library(SOURCE) == library
    assert compiler.count == before + 1
    assert ctypes.CDLL(str(library)).product(6, -7) == -42
    assert shared_library(SOURCE) == library
    assert compiler.count == before + 1


def test_a_folder_from_which_nothing_can_be_loaded(
    compiler: Compiler, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """As on a file system that is mounted with ``noexec``."""
    load = ctypes.CDLL

    def refuse(path: str) -> ctypes.CDLL:
        if path.startswith(str(tmp_path / "cache")):
            raise OSError(f"{path}: failed to map segment from shared object")
        return load(path)

    monkeypatch.setattr(c_library.ctypes, "CDLL", refuse)
    with pytest.warns(RuntimeWarning, match="failed to map segment from shared object; set XDG_CACHE_HOME"):
        library = shared_library(SOURCE)
    assert load(str(library)).product(6, -7) == -42
