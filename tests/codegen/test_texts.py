"""A user's names and units in generated files: shown, and never more than text.

Red when a name ends a comment, a string or a table, and becomes code.
"""

import json
import re

import pytest

from focgen.codegen.generate import generate
from focgen.codegen.names import check_name, suggestion
from focgen.codegen.render import _environment, render
from focgen.codegen.texts import UserText, comment, markdown, printf, string
from focgen.control.controller import Units
from focgen.control.files import read_controller
from focgen.errors import InputError
from tests.c_code import compiler, run
from tests.conftest import paper_controller

WARNINGS = "-Wall -Wextra -Werror -Wtrigraphs -Wcomment -Wformat=2".split()

HOSTILE = {
    "a call": '"); system("touch hacked"); printf("',
    "a quote": '"',
    "a backslash": "\\",
    "backslashes and quotes": '\\"\\\\"\\',
    "an escape": "\\n\\x41\\0",
    "percent": "%",
    "formats": "%s%n%d%%%1$s%",
    "end of a comment": "*/ int x = 1; /*",
    "begin of a comment": "/* // */",
    "line comment and continuation": "// \\\n int y;",
    "a continuation": "abc\\",
    "trigraphs": "??/ ??' ??) ??= ?" + "?/",
    "a question": "?????/",
    "lines": "a\nb\r\nc\u2028d\u0085e\fg\vh",
    "controls": "a\0b\x1b[31mred\x07\x7f",
    "turned about": "a\u202eb\u200bc\ufeff",
    "greek": "µ °C Ω·m² – ü",
    "far": "温度 😀",
    "mathtext": "$\\frac{$ x",
    "a directive": '\n#include "/etc/passwd"\n#error no',
    "a table": "a | b `c` | <script>alert(1)</script> [x](http://y) **z** &amp;",
    "jinja": "{{ 7 * 7 }}{% raw %}",
}


def controller_named(text: str, **changes):
    return paper_controller(12, name=text, units=Units(text, text, text), **changes)


BOTH = ("c99", "gnu11")  # trigraphs are on, and off


def standards(what: str, turn: int) -> tuple[str, ...]:
    """Those that the short suite compiles a text by: both where trigraphs tell them apart, else by turns."""
    return BOTH if "??" in HOSTILE[what] else (BOTH[turn // 2 % 2],)


@pytest.mark.parametrize(
    "what, arithmetic, standards",
    [
        *(
            pytest.param(what, ("q31", "f32")[turn % 2], standards(what, turn), id=what)
            for turn, what in enumerate(HOSTILE)
        ),
        *(
            pytest.param(what, arithmetic, BOTH, id=f"{what}-{arithmetic}", marks=pytest.mark.long)
            for what in HOSTILE
            for arithmetic in ("q31", "f32")
        ),
    ],
)
def test_hostile_text_compiles_and_is_printed(tmp_path, what, arithmetic, standards):
    text = HOSTILE[what]
    generate(controller_named(text), tmp_path, arithmetic, name="loop", selftest=True)
    sources = [tmp_path / "loop.c", tmp_path / "loop_selftest.c", tmp_path / "example" / "main.c"]
    for standard in standards:
        program = tmp_path / f"{standard}.exe"
        flags = [f"-std={standard}", "-O1", "-ffp-contract=off", *WARNINGS, f"-I{tmp_path}"]
        run(*compiler("gcc"), *flags, *sources, "-o", program)
        said = run(program, cwd=tmp_path).splitlines()
        assert len(said) == 10 and all(re.match(r" \d  -?[\d.e+-]+( |$)", line) for line in said)
        shown = "".join(char if char.isprintable() else "?" for char in " ".join(text.split()))
        end = "  at its upper end"
        units = [line.removesuffix(end)[4:].partition(" ")[2] for line in said]
        assert units == [shown] * 10
        assert not (tmp_path / "hacked").exists()


@pytest.mark.parametrize("what", HOSTILE)
def test_a_folder_of_hostile_text_is_read_back(tmp_path, what):
    generate(controller_named(HOSTILE[what]), tmp_path, "q15", name="loop")
    assert read_controller(tmp_path / "controller.toml").units.output == HOSTILE[what]
    assert json.loads((tmp_path / "manifest.json").read_text(encoding="utf-8"))["name"] == "loop"


@pytest.mark.parametrize("what", HOSTILE)
def test_a_comment_is_one_line_of_ascii_that_does_not_end(what):
    found = comment(HOSTILE[what])
    assert (found.isascii() and found.isprintable()) or not found
    assert not any(part in found for part in ("*/", "/*", "\\", "??", "\n"))
    assert comment(found) == found, "nothing is left to escape"


def test_each_place_has_its_rule():
    assert string('a"b\\c?d%') == 'a\\"b\\\\c\\?d%' and printf("50 %") == "50 %%"
    assert string("µ") == "\\302\\265" and string("a\n\tb\0") == "a b\\?"
    assert markdown("a|b`<i>$x_y$") == "a\\|b\\`\\<i\\>\\$x\\_y\\$"
    assert comment("µm/s²") == "um/s^2" and markdown("µm/s²") == "µm/s²"
    assert [rule("1/mm") for rule in (comment, string, printf, markdown)] == ["1/mm"] * 4


def test_the_table_of_the_readme_keeps_its_columns(tmp_path):
    generate(controller_named(HOSTILE["a table"]), tmp_path, "q15", name="loop")
    page = (tmp_path / "README.md").read_text(encoding="utf-8")
    rows = [line for line in page.splitlines() if line.startswith("| `")]
    assert len(rows) == 4 and all(len(re.split(r"(?<!\\)\|", row)) == 8 for row in rows)
    assert not re.search(r"(?<!\\)<script", page) and not re.search(r"(?<!\\)\[x\]", page)


BARE = ("{{ name }}", "{{ 'a ' ~ name }}", "{{ name | upper }}", "{{ [name] | join }}", "{{ '%s' % name }}")


@pytest.mark.parametrize("text", BARE)
def test_a_template_cannot_print_it_without_a_rule(text):
    template = _environment().from_string(text)
    with pytest.raises(TypeError, match="through a filter"):
        template.render(name=UserText("x"))
    assert _environment().from_string("{{ name | comment }}").render(name=UserText("a */")) == "a * /"


def test_contexts_carry_names_and_units_as_such(monkeypatch, tmp_path):
    """What reaches a template as plain text holds nothing of a name or a unit."""
    from focgen.codegen import generate as module

    seen = {}
    noted = lambda name, context: seen.setdefault(name, context) and render(name, context)
    monkeypatch.setattr(module, "render", noted)
    generate(controller_named("§§§"), tmp_path, "q15", name="loop")
    assert len(seen) == 4
    for name, context in seen.items():
        plain = re.sub(r"UserText\(text='[^']*'\)", "", repr(context))
        assert "§" not in plain, name


# ------------------------------------------------------------------------------------------------- names

REFUSED = {
    "is a name of C's library": "NULL printf INT32_MAX UINT8_C int32_t size_t sinf EOF main SIGINT".split(),
    "is a keyword": "int class restrict".split(),
    "is reserved": "_Foo __x _ foc_integral FOC_x foc_ x_selftest X_SELFTEST _selftest".split(),
    "cannot be a file on Windows": "con CON Aux nul com1 LPT9 prn".split(),
    "characters": ["x" * 64, "C" * 300],
    "is no C identifier": ["a b", "1a", "", "ü", "a\n", "a;b", "../x", "/abs", "a" * 300 + "."],
}


@pytest.mark.parametrize("fault, name", [(fault, name) for fault, names in REFUSED.items() for name in names])
def test_a_name_that_cannot_be_one_is_refused_with_one_that_can(fault, name):
    with pytest.raises(InputError) as told:
        check_name(name, "here")
    assert fault in told.value.what and len(str(told.value)) < 400
    assert check_name(suggestion(name), "here") == suggestion(name)


ORDINARY = (
    "spba loop1 torque signal_1 SIGMA island memory filter gain X M_1 index contact PRIx lag Int".split()
)


@pytest.mark.parametrize("name", ORDINARY)
def test_ordinary_names_are_let_pass(name):
    assert check_name(name, "here") == name
