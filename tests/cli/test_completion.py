"""Completion in real shells: commands, options, values, and file names where nothing else fits.

Red when a shell is offered a word that does not exist, or not offered one that does.
"""

from __future__ import annotations

import pytest

from focgen.cli.completion import SHELLS
from focgen.cli.main import commands, main
from tests.c_code import run, tool


@pytest.fixture
def completion(tmp_path, capsys):
    """The path of a shell's script, as the command prints it."""

    def made(shell: str):
        with pytest.raises(SystemExit) as end:
            main(["--print-completion", shell])
        captured = capsys.readouterr()
        assert end.value.code == 0 and captured.err == ""
        (tmp_path / "script").write_text(captured.out)
        return tmp_path / "script"

    return made


CASES = [
    (["focgen", "ident"], {"identify"}),
    (["focgen", "s"], {"simulate", "study"}),
    (["focgen", "generate", "c.toml", "--arithmetic", "q"], {"q15", "q31"}),
    (["focgen", "generate", "c.toml", "--ar"], {"--arithmetic"}),
    (["focgen", "generate", "--for", "a"], {"arduino"}),
    (["focgen", "study", "mem"], {"memory"}),
    (["focgen", "--print-completion", "z"], {"zsh"}),
    (["focgen", "verify", "--js"], {"--json"}),
    (["focgen", "verify", "firmw"], set()),
    (["focgen", "generate", "--out", "q"], set()),
]


@pytest.mark.parametrize(("words", "found"), CASES, ids=lambda x: " ".join(x) if isinstance(x, list) else "")
def test_bash(completion, words, found):
    line = " ".join(f"'{word}'" for word in words)
    said = run(
        tool("bash"),
        "-euc",
        f"source {completion('bash')}; COMP_WORDS=({line}); COMP_CWORD={len(words) - 1}; _focgen; "
        'printf "%s\\n" "${COMPREPLY[@]:-}"; complete -p focgen',
    ).splitlines()
    assert set(filter(None, said[:-1])) == found and said[-1] == "complete -o default -F _focgen focgen"


def test_fish(completion, tmp_path):
    script = completion("fish")
    for words, found in CASES:
        asked = f"source {script}; complete -C '{' '.join(words)}'"
        said = {
            line.split("\t")[0]
            for line in run(tool("fish"), "--no-config", "-c", asked, cwd=tmp_path).splitlines()
        }
        assert said == found, words


def test_zsh(completion):
    code = f"source {completion('zsh')}; print -r -- ${{_comps[focgen]}}; whence -w _focgen"
    said = run(tool("zsh"), "-fc", code)
    assert "_bash_complete" in said and "-F _focgen" in said and "_focgen: function" in said


def test_every_command_is_completed_and_no_other_shell(completion, capsys):
    for shell in SHELLS:
        text = completion(shell).read_text()
        assert all(f" {name} " in f"{text}".replace('"', " ").replace(")", " ") for name in commands())
    assert main(["--print-completion", "tcsh"]) == 2
    assert "invalid choice" in capsys.readouterr().err
