"""Changes of C, of templates of it, and of assembly in it: no C is parsed, every token is looked at."""

from __future__ import annotations

import re

from tests.mutants.change import Change

_SWAPS = {
    "<=": ("<",), "<": ("<=",), ">=": (">",), ">": (">=",), "==": ("!=",), "!=": ("==",),
    "+": ("-",), "-": ("+",), "*": ("+",), "&": ("|",), "|": ("&",),
    "<<": (">>",), ">>": ("<<",), "&&": ("||",), "||": ("&&",),
    "+=": ("-=",), "-=": ("+=",), "|=": ("&=",), "&=": ("|=",),
}  # fmt: skip
_OPERATOR = re.compile(r"(?<= )(<<|>>|<=|>=|==|!=|&&|\|\||\+=|-=|\|=|&=|[-+*<>&|])(?= )")
_NUMBER = re.compile(r"(?<![\w.])(0x[0-9a-fA-F]+|\d+)(?=[uU]?(?:ll|LL)?(?![\w.]))")
_REAL = re.compile(r"(?<![\w.])(\d+\.\d+)(?=f?\b)")
_NOT = re.compile(r"!(?=[\w(])")
_CAST = re.compile(r"\((u?)int64_t\)")
_CALL = re.compile(r"\b(foc_clamp\w*|foc_sat\w+|foc_shift\d\d)\(")
_LINE = re.compile(
    r"(?m)^ +(?!return\b|const\b|break\b|else\b)[\w>.\[\]-]+(?: [-+|&]?= [^;\n]*|\([^;\n]*\));$"
)
_JINJA = re.compile(r"\{%-? (?:el)?if (.*?) -?%\}")
_HIDDEN = re.compile(
    r"/\*.*?\*/|\{#.*?#\}|\{%.*?%\}|\{\{.*?\}\}|//[^\n]*|\"(?:\\.|[^\"\\\n])*\"|'(?:\\.|[^'\\])'"
    r"|^[ ]*#(?!define)[^\n]*",
    re.DOTALL | re.MULTILINE,
)
_SHOWN = re.compile(r"\"(?:\\.|[^\"\\\n])*\"")
_MNEMONIC = {
    "add": "sub", "adds": "subs", "sub": "add", "subs": "adds", "lsl": "lsr", "lsls": "lsrs", "lsr": "lsl",
    "lsrs": "lsls", "asr": "lsr", "asrs": "lsrs", "beq": "bne", "bne": "beq", "bls": "bhi", "bhi": "bls",
    "bcc": "bcs", "bcs": "bcc", "blt": "bge", "bge": "blt", "bgt": "ble", "ble": "bgt", "adcs": "adds",
    "adc": "add", "smlal": "smull", "smlad": "smladx", "smlald": "smlaldx", "it mi": "it pl",
    "vmla.f32": "vmls.f32", "vadd.f32": "vsub.f32", "muls": "ands", "sxth": "uxth", "uxth": "sxth",
}  # fmt: skip
_ASSEMBLY = re.compile(
    r"(?<![\w.])(" + "|".join(map(re.escape, sorted(_MNEMONIC, key=len)[::-1])) + r")(?= )"
)
_IMMEDIATE = re.compile(r"(?<=#)\d+")


def changes(file: str, text: str) -> list[Change]:
    """Every change of one file."""
    bare = _HIDDEN.sub(lambda m: re.sub(r"[^\n]", "\0", m[0]), text)
    found = [
        Change(file, m.start(), m[0], new, "operator")
        for m in _OPERATOR.finditer(bare)
        for new in _SWAPS[m[0]]
    ]
    found += [
        Change(file, m.start(), m[0], str(int(m[0], 0) + 1), "constant") for m in _NUMBER.finditer(bare)
    ]
    found += [
        Change(file, m.start(), m[0], repr(float(m[0]) + 1.0), "constant") for m in _REAL.finditer(bare)
    ]
    found += [Change(file, m.start(), "!", "", "negation lost") for m in _NOT.finditer(bare)]
    found += [Change(file, m.start(), m[0], f"({m[1]}int32_t)", "width") for m in _CAST.finditer(bare)]
    found += [c for m in _CALL.finditer(bare) for c in _unlimited(file, text, bare, m)]
    found += [
        Change(file, m.start(), m[0], " ;", "statement lost")
        for m in _LINE.finditer(bare)
        if "\0" not in m[0]
    ]
    found += [
        Change(file, m.start(1), m[1], f"not ({m[1]})", "condition of the template")
        for m in _JINJA.finditer(text)
    ]
    return found + _of_assembly(file, text)


def _unlimited(file: str, text: str, bare: str, call: re.Match) -> list[Change]:
    """A clamp, a saturation or a rounding shift that is one no longer."""
    depth, place, commas = 1, call.end(), []
    while depth and place < len(bare):
        depth += {"(": 1, ")": -1}.get(bare[place], 0)
        if bare[place] == "," and depth == 1:
            commas.append(place)
        place += 1
    declared = re.search(r"\w+ $", bare[: call.start()]) and not re.search(r"return $", bare[: call.start()])
    if depth or declared:
        return []
    first = text[call.end() : commas[0] if commas else place - 1]
    old = text[call.start() : place]
    if call[1].startswith("foc_shift"):
        return [Change(file, call.start(), old, f"(({first}) >> ({text[commas[0] + 1 : place - 1].strip()}))",
                       "rounding lost")]  # fmt: skip
    return [Change(file, call.start(), old, f"({first})", "saturation lost")]


def _of_assembly(file: str, text: str) -> list[Change]:
    """Instructions and their constants, in strings of files that hold assembly."""
    if "__asm__" not in text:
        return []
    shown, cut = [" "] * len(text), text.find("__asm__")
    bare = re.sub(r"/\*.*?\*/", lambda m: " " * len(m[0]), text, flags=re.DOTALL)
    for m in _SHOWN.finditer(bare, cut):
        shown[m.start() : m.end()] = m[0]
    strings = "".join(shown)
    found = [
        Change(file, m.start(), m[0], _MNEMONIC[m[0]], "instruction") for m in _ASSEMBLY.finditer(strings)
    ]
    more = (
        Change(file, m.start(), m[0], str(int(m[0]) * 2 or 4), "immediate")
        for m in _IMMEDIATE.finditer(strings)
    )
    return found + list(more)
