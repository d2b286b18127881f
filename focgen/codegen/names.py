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
    wchar wctype
""".split()


# Of C's library: functions, objects, types and macros, which a controller must not be mistaken for.
_STANDARD = """
    abort abs aligned_alloc asctime atexit atof atoi atol atoll bsearch calloc clearerr clock ctime
    difftime div exit fclose feof ferror fflush fgetc fgetpos fgets fopen fprintf fputc fputs fread free
    freopen fscanf fseek fsetpos ftell fwrite getc getchar getenv gets gmtime imaxabs imaxdiv isalnum
    isalpha isblank iscntrl isdigit isfinite isgraph isinf islower isnan isnormal isprint ispunct isspace
    isupper isxdigit labs ldiv llabs lldiv localeconv localtime longjmp main malloc mblen mbstowcs mbtowc
    memchr memcmp memcpy memmove memset mktime perror printf putc putchar puts qsort raise rand realloc
    remove rename rewind scanf setbuf setjmp setlocale setvbuf signbit snprintf sprintf srand sscanf
    strcat strchr strcmp strcoll strcpy strcspn strerror strftime strlen strncat strncmp strncpy strpbrk
    strrchr strspn strstr strtod strtof strtoimax strtok strtol strtold strtoll strtoul strtoull strtoumax
    strxfrm system time tmpfile tmpnam ungetc va_arg va_copy va_end va_list va_start vfprintf vfscanf
    vprintf vscanf vsnprintf vsprintf vsscanf wcstombs wctomb linux unix stdin stdout stderr environ
    offsetof jmp_buf fpos_t div_t ldiv_t tm lconv NULL EOF FILE BUFSIZ EXIT_FAILURE EXIT_SUCCESS
    FILENAME_MAX FOPEN_MAX RAND_MAX CLOCKS_PER_SEC EDOM ERANGE EILSEQ HUGE_VAL INFINITY NAN CHAR_BIT
    MB_CUR_MAX MB_LEN_MAX TMP_MAX L_tmpnam NDEBUG I
""".split()
_TYPES_AND_LIMITS = re.compile(  # of stdint.h, limits.h, float.h, math.h, inttypes.h, signal.h
    r"u?int(_least|_fast)?\d+_t|u?int(max|ptr)_t|(s?size|ptrdiff|wchar|wint|sig_atomic|clock|time)_t"
    r"|U?INT(_LEAST|_FAST)?\d+_(MIN|MAX|C)|U?INT(MAX|PTR)?_(MIN|MAX|C)"
    r"|(CHAR|[SU]CHAR|U?SHRT|U?LONG|U?LLONG|SIZE|PTRDIFF|WCHAR|WINT|SIG_ATOMIC)_(MIN|MAX)"
    r"|(FLT|DBL|LDBL)_[A-Z0-9_]+|FP_(NAN|INFINITE|ZERO|SUBNORMAL|NORMAL|ILOGB0|ILOGBNAN)"
    r"|M_(E|LOG2E|LOG10E|LN2|LN10|PI|PI_[24]|[12]_PI|2_SQRTPI|SQRT2|SQRT1_2)"
    r"|(PRI|SCN)[diouxX](LEAST|FAST)?(8|16|32|64|MAX|PTR)|SIG(ABRT|FPE|ILL|INT|SEGV|TERM|_DFL|_ERR|_IGN)"
    r"|SEEK_(SET|CUR|END)|LC_(ALL|COLLATE|CTYPE|MONETARY|NUMERIC|TIME)"
)
_MATHS = """
    acos acosh asin asinh atan atan2 atanh cbrt ceil copysign cos cosh erf erfc exp exp2 expm1 fabs fdim floor
    fma fmax fmin fmod frexp hypot ilogb ldexp lgamma llrint llround log log10 log1p log2 logb lrint lround
    modf nan nearbyint nextafter nexttoward pow remainder remquo rint round scalbln scalbn sin sinh sqrt tan
    tanh tgamma trunc
""".split()
_LETTERED = frozenset(f"{name}{end}" for name in _MATHS for end in "fl")  # sinf, sinl, …

# Files of these names cannot be on Windows, whatever their ending.
_DEVICES = re.compile(r"con|prn|aux|nul|com\d|lpt\d", re.IGNORECASE)

_RUNTIME = "foc_"  # headers and functions that stand beside every controller
_TEST = "_selftest"  # NAME_selftest.c stands beside NAME.c

LONGEST = 63  # characters of a name that C tells apart


def check_name(name: str, where: str) -> str:
    """Return ``name`` if it can prefix C identifiers and name a header.

    Raises InputError, with a name that can, otherwise.
    """
    fault = _fault(name)
    if fault:
        raise InputError(
            where, f"the name {_short(name)!r} {fault}", f"give --name, for example --name {suggestion(name)}"
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
    if name.lower().startswith(_RUNTIME):
        return f"is reserved: files and functions of the runtime begin with {_RUNTIME}"
    if name.lower().endswith(_TEST):
        return f"is reserved: it would be the self-test of {name[: -len(_TEST)] or 'a controller'}"
    if name in _STANDARD or name in _MATHS or name in _LETTERED or _TYPES_AND_LIMITS.fullmatch(name):
        return "is a name of C's library"
    if _DEVICES.fullmatch(name):
        return "cannot be a file on Windows"
    if len(name) > LONGEST:
        return f"has {len(name)} characters, of which C tells {LONGEST} apart"
    return None


def _short(name: str) -> str:
    return name if len(name) <= LONGEST else f"{name[:LONGEST]}…"


def suggestion(name: str) -> str:
    """A name like ``name`` that is free."""
    letters = re.sub(r"[^A-Za-z0-9]+", "_", name).strip("_")[:40].strip("_")
    while letters.lower().startswith(_RUNTIME):
        letters = letters[len(_RUNTIME) :]
    free = letters if letters and not letters[0].isdigit() else f"c{letters}"
    return free if _fault(free) is None else f"{free}_controller"
