"""The controller's name as the prefix of C identifiers and as a file name."""

from __future__ import annotations

import re

from focgen.errors import InputError

_C_KEYWORDS = """
    auto break case char const continue default do double else enum extern float for goto if int long register
    return short signed sizeof static struct switch typedef union unsigned void volatile while
    inline restrict _Bool _Complex _Imaginary
    _Alignas _Alignof _Atomic _Generic _Noreturn _Static_assert _Thread_local
    alignas alignof bool constexpr false nullptr static_assert thread_local true typeof typeof_unqual
    _BitInt _Decimal32 _Decimal64 _Decimal128
    asm fortran
""".split()  # C89, C99, C11, C23, common extensions

_CPP_KEYWORDS = """
    and and_eq bitand bitor catch class compl const_cast delete dynamic_cast explicit export friend mutable
    namespace new noexcept not not_eq operator or or_eq private protected public reinterpret_cast static_cast
    template this throw try typeid typename using virtual wchar_t xor xor_eq
""".split()

# A header of this name beside the sources would hide the one it is named after.
_HEADERS = """
    assert complex ctype errno fenv float inttypes iso646 limits locale math setjmp signal stdalign stdarg
    stdatomic stdbit stdbool stdckdint stddef stdint stdio stdlib stdnoreturn string tgmath threads time uchar
    wchar wctype foc_rt foc_memory foc_long foc_tiles
    foc_ahead_q15 foc_ahead_q31 foc_ahead_f32
    foc_m0_q15 foc_m0_q31 foc_m3_q15 foc_m3_q31 foc_m4_q15 foc_m4_f32
""".split()


def check_name(name: str, where: str) -> str:
    """Return ``name`` if it can prefix C identifiers and name a header.

    Raises InputError, with a name that can, otherwise.
    """
    fault = _fault(name)
    if fault:
        raise InputError(
            where, f"the name {name!r} {fault}", f"give --name, for example --name {suggestion(name)}"
        )
    return name


def _fault(name: str) -> str | None:
    if not re.fullmatch(r"[A-Za-z_][A-Za-z0-9_]*", name):
        return "is no C identifier"
    if name.startswith("_"):
        return "is reserved: it begins with an underscore"
    if name in _C_KEYWORDS or name in _CPP_KEYWORDS:
        return "is a keyword"
    if name.lower() in _HEADERS:
        return f"would hide the header {name.lower()}.h"
    return None


def suggestion(name: str) -> str:
    """A name like ``name`` that is free."""
    letters = re.sub(r"[^A-Za-z0-9]+", "_", name).strip("_")
    free = letters if letters and not letters[0].isdigit() else f"c{letters}"
    return free if _fault(free) is None else f"{free}_controller"
