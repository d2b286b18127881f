"""The compiler that $CC names, whatever it is: one line, and no end of the process that asked.

Red when a $CC that is no command is a fault of the program, or what it makes ends the command as if a check
did not hold.
"""

import os
import subprocess

import pytest

from focgen.children import environment, python
from focgen.codegen.generate import generate
from focgen.compiler import compile_shared, find_compiler
from focgen.errors import BuildError
from focgen.verification.verify import verify
from tests.controllers import seed_controller

posix = pytest.mark.skipif(os.name != "posix", reason="the system has no such signals")

# What a compiler may make: it ends whoever loads it, in order or not; it is cut; it never lets go.
MADE = {
    "an exit": "__attribute__((constructor)) static void f(void) { exit(1); }",
    "a crash": "__attribute__((constructor)) static void f(void) { abort(); }",
    "half of it": None,
}


@pytest.fixture
def chosen(tmp_path, monkeypatch):
    """$CC as a script that makes one of these."""

    def choose(kind: str) -> None:
        (tmp_path / "evil.h").write_text(f"#include <stdlib.h>\n{MADE[kind] or ''}\n")
        cut = 'for a; do [ "$p" = -o ] && truncate -s 3000 "$a"; p=$a; done' if MADE[kind] is None else ""
        own = " ".join(find_compiler())
        path = tmp_path / "compiler"
        path.write_text(f'#!/bin/sh\n{own} "$@" -include {tmp_path}/evil.h || exit 1\n{cut}\n')
        path.chmod(0o755)
        monkeypatch.setenv("CC", str(path))

    return choose


@posix
@pytest.mark.parametrize("kind", MADE)
def test_what_ends_its_loader_is_not_loaded(tmp_path, chosen, kind):
    chosen(kind)
    (tmp_path / "x.c").write_text("int x(void) { return 7; }\n")
    with pytest.raises(BuildError, match="ends the process that loads it"):
        compile_shared([tmp_path / "x.c"], tmp_path / "x.so")


@posix
def test_a_command_ends_in_a_line_and_not_as_if_a_check_did_not_hold(tmp_path, chosen):
    """-fsanitize=address does so: exit status 1, in words of its own."""
    generate(seed_controller(5), tmp_path / "fw", "q15")
    chosen("an exit")
    (tmp_path / "temp").mkdir()
    done = subprocess.run(
        python("-m", "focgen", "verify", str(tmp_path / "fw")),
        env=environment(TMPDIR=str(tmp_path / "temp")),
        capture_output=True,
        text=True,
    )
    assert done.returncode == 2 and done.stderr.count("\n") == 1, done.stderr
    assert not list((tmp_path / "temp").iterdir())


@posix
def test_a_compiler_of_ones_own_is_used(tmp_path, monkeypatch):
    monkeypatch.setenv("CC", " ".join([*find_compiler(), "-DSEVEN=7"]))
    (tmp_path / "x.c").write_text("int x(void) { return SEVEN; }\n")
    compile_shared([tmp_path / "x.c"], tmp_path / "x.so")


@pytest.mark.parametrize("words", ['cc -DX="', "cc '", "cc \\"])
def test_a_quote_that_does_not_close_is_told(monkeypatch, words):
    monkeypatch.setenv("CC", words)
    with pytest.raises(BuildError, match="is no command"):
        find_compiler()


@posix
def test_a_compiler_that_makes_nothing_is_told(tmp_path, monkeypatch):
    """Its folder was blamed before."""
    generate(seed_controller(5), tmp_path / "fw", "q15")
    idle = tmp_path / "idle"
    idle.write_text("#!/bin/sh\nexit 0\n")
    idle.chmod(0o755)
    monkeypatch.setenv("CC", str(idle))
    with pytest.raises(BuildError, match="writes nothing: it is no compiler; unset CC"):
        verify(tmp_path / "fw", 100)


@posix
@pytest.mark.parametrize("kind", ["folder", "text", "absent"])
def test_what_is_no_program_is_told(tmp_path, monkeypatch, kind):
    (tmp_path / "folder").mkdir()
    (tmp_path / "text").write_text("no program\n")
    monkeypatch.setenv("CC", str(tmp_path / kind))
    with pytest.raises(BuildError, match="no program that can be run"):
        find_compiler()
