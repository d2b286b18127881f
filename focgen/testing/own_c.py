"""``from_c``: somebody's own C as an object with ``reset``, ``step`` and ``track`` in counts."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cffi import FFI

from focgen.codegen.render import render
from focgen.compiler import compile_shared
from focgen.errors import BuildError, InputError
from focgen.plan.scenario import Params
from focgen.scratch import temporary_folder
from focgen.verification.host import FLAGS

_CALLS = ("init", "reset", "step", "track", "flags", "tune")
_STRICT = "-Werror=implicit-function-declaration"


@dataclass(frozen=True)
class _Glue:
    """Everything ``candidate.c.jinja`` asks for; "" for a function that there is not."""

    header: str
    state: str
    scheduled: bool
    init: str
    reset: str
    step: str
    track: str
    flags: str
    tune: str
    params: str


class OwnC:
    """Somebody's own C, with one state. ``scheduled``: whether its step takes a scheduling signal.

    ``init``, ``track``, ``flags`` and ``tune`` are there where the C has them.
    """

    isolated = True

    def __init__(self, name: str, library: Any, ffi: FFI, glue: _Glue) -> None:
        self.name, self.scheduled = name, glue.scheduled
        self._library, self._ffi = library, ffi
        self._state = ffi.new("double[]", -(-library.focgen_bytes() // 8) or 1)  # aligned for every member
        if glue.init:
            self.init: Callable[[], None] = lambda: library.focgen_init(self._state)
            self.init()
        if glue.track:
            self.track = lambda u: library.focgen_track(self._state, u)
        if glue.flags:
            self.flags = lambda: library.focgen_flags(self._state)
        if glue.tune:
            self.tune = self._tune

    def reset(self, ref: float, meas: float, u0: float) -> None:
        """PREFIX_reset, in counts."""
        self._library.focgen_reset(self._state, ref, meas, u0)

    def step(self, ref: float, meas: float, sched: float = 0) -> float:
        """PREFIX_step, in counts; ``sched`` is not passed on where it takes none."""
        u: float = self._library.focgen_step(self._state, ref, meas, sched)
        return u

    def _tune(self, params: Params) -> None:
        """PREFIX_tune, in counts."""
        self._library.focgen_tune(self._state, list(map(float, params.gain)), params.u_min, params.u_max)

    def __repr__(self) -> str:
        return f"<C of {self.name}>"


def from_c(
    sources: str | Path | Sequence[str | Path],
    prefix: str,
    *,
    state: str | None = None,
    header: str | Path | None = None,
    names: Mapping[str, str] | None = None,
    include: Sequence[str | Path] = (),
    flags: Sequence[str] = FLAGS,
) -> OwnC:
    """Compile C of your own, and return it as a candidate for :func:`assert_equivalent`.

    The C has PREFIX_reset(state *, ref, meas, u0), PREFIX_step(state *, ref, meas) or PREFIX_step(state *,
    ref, meas, sched), and, where it can, PREFIX_init(state *), PREFIX_track(state *, u), PREFIX_flags(state
    *) and PREFIX_tune(state *, const PREFIX_params *), on a state of type ``state`` (PREFIX_state), which may
    hold anything. ``names`` gives other names, such as {"step": "valve_update"}. They are declared in
    ``header``: by default the first .h among ``sources``, else PREFIX.h beside one of them, else the first
    source itself is included.
    ``include`` are further folders of headers, ``flags`` those of the compiler.

    Raises InputError where a file or a function is missing, BuildError where the C does not compile.
    """
    files = [Path(p).resolve() for p in ([sources] if isinstance(sources, (str, Path)) else sources)]
    _check_files(files)
    top = Path(header).resolve() if header is not None else _header(files, prefix, include)
    _check_files([top])
    compiled = [f for f in files if f.suffix != ".h" and f != top]
    text = "\n".join(f.read_text(encoding="utf-8", errors="replace") for f in dict.fromkeys([top, *files]))
    glue = _glue(prefix, state or f"{prefix}_state", top, names or {}, text)
    folders = list(dict.fromkeys([*(f.parent for f in files), top.parent, *map(Path, include)]))
    return OwnC(prefix, *_compiled(glue, compiled, folders, flags, files[0]), glue)


def _check_files(files: Sequence[Path]) -> None:
    if not files:
        raise InputError("from_c", "was given no source", "name the C files of your controller")
    for file in files:
        if not file.is_file():
            raise InputError(str(file), "is no file", "name the C files of your controller")


def _header(files: Sequence[Path], prefix: str, include: Sequence[str | Path]) -> Path:
    """The file that declares the controller."""
    given = [f for f in files if f.suffix == ".h"]
    beside = [Path(folder) / f"{prefix}.h" for folder in (*(f.parent for f in files), *include)]
    return next((f.resolve() for f in (*given, *beside) if f.is_file()), files[0])


def _glue(prefix: str, state: str, header: Path, names: Mapping[str, str], text: str) -> _Glue:
    unknown = sorted(names.keys() - set(_CALLS))
    if unknown:
        raise InputError("from_c", f"names {unknown[0]!r}", f"name one of {', '.join(_CALLS)}")
    called = {call: names.get(call, f"{prefix}_{call}") for call in _CALLS}
    found = {call: name if _mentions(text, name) else "" for call, name in called.items()}
    for call in (*names, "reset", "step"):
        if not found[call]:
            remedy = f"give its name as names={{{call!r}: ...}}, or the file that has it among the sources"
            raise InputError(str(header), f"has no function {called[call]}", remedy)
    return _Glue(header.as_posix(), state, _takes_schedule(called["step"], header, text), **found,
                 params=f"{prefix}_params")  # fmt: skip


def _mentions(text: str, name: str) -> bool:
    return re.search(rf"\b{re.escape(name)}\s*\(", text) is not None


def _takes_schedule(step: str, header: Path, text: str) -> bool:
    """Whether the step has four arguments."""
    lists = re.findall(rf"\b{re.escape(step)}\s*\(([^()]*)\)", text)
    counts = {len(arguments.split(",")) for arguments in lists} & {3, 4}
    if not counts:
        what = f"{step} takes neither (state, ref, meas) nor (state, ref, meas, sched)"
        raise InputError(str(header), what, "write a function of a few lines that does")
    return max(counts) == 4


def _compiled(
    glue: _Glue, sources: Sequence[Path], folders: Sequence[Path], flags: Sequence[str], first: Path
) -> tuple[Any, FFI]:
    ffi = FFI()
    ffi.cdef(_declarations(glue))
    with temporary_folder() as scratch:
        main, target = scratch / "glue.c", scratch / "candidate.so"
        main.write_text(render("candidate.c.jinja", glue))
        try:
            compile_shared([*sources, main], target, (*flags, _STRICT), folders)
            return ffi.dlopen(str(target)), ffi
        except BuildError as error:
            raise BuildError(str(first), error.what, "correct the C, or what from_c was told of it") from None
        except OSError as reason:
            what = f"does not link: {str(reason).rpartition(': ')[2]}"
            raise BuildError(str(first), what, "name every C file of your controller") from None


def _declarations(glue: _Glue) -> str:
    optional = {
        "void focgen_init(void *);": glue.init,
        "void focgen_track(void *, double);": glue.track,
        "uint32_t focgen_flags(void *);": glue.flags,
        "void focgen_tune(void *, const double *, double, double);": glue.tune,
    }
    return (
        "uint32_t focgen_bytes(void); void focgen_reset(void *, double, double, double); "
        "double focgen_step(void *, double, double, double); "
        + " ".join(text for text, there in optional.items() if there)
    )
