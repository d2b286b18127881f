"""From a controller to a folder of C."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from focgen.arguments import checked
from focgen.codegen.edited import check_unedited
from focgen.codegen.fits import check_fits
from focgen.codegen.folder import example_context, readme_context
from focgen.codegen.header import header_context
from focgen.codegen.kernels import PORTABLE, TARGETS, Kernels, runtime_files
from focgen.codegen.leftovers import leftovers
from focgen.codegen.manifest import manifest_of, sha256
from focgen.codegen.names import check_name
from focgen.codegen.neighbours import check_told_apart, kept, taken_back
from focgen.codegen.packages.archive import archived
from focgen.codegen.packages.context import Made
from focgen.codegen.packages.package import PACKAGES, PLAIN, Package, check_package, packed
from focgen.codegen.render import render
from focgen.codegen.selftest import selftest_files
from focgen.codegen.source import source_context
from focgen.control.controller import ARITHMETICS, MEMORIES, Controller
from focgen.control.files import ControllerLike, controller_from, controller_text
from focgen.errors import InputError, check_choice
from focgen.fractional.continuous import HIGHEST, OPERATORS, RATIOS
from focgen.fractional.exponential import HORIZONS, TOLERANCES
from focgen.output import check_apart, write_files
from focgen.plan.build import build_plan
from focgen.plan.plan import LONGEST, Plan
from focgen.resources import shipped
from focgen.shown import Shown
from focgen.spelling import respelled
from focgen.tomlfile import parsed

__all__ = ["PACKAGES", "Generated", "folder_files", "generate"]


@dataclass(frozen=True, repr=False)
class Generated(Shown):
    """What :func:`generate` has written: the ``files`` of ``folder``, ``plan`` and ``manifest``."""

    folder: Path
    files: tuple[str, ...]
    plan: Plan
    manifest: dict[str, Any]


@respelled({"package": "for_"})
@checked
def generate(
    controller: ControllerLike,
    out: str | Path,
    arithmetic: str | None = None,
    memory: str | None = None,
    length: int | None = None,
    name: str | None = None,
    target: str | None = None,
    for_: str = "plain",
    tolerance: float | None = None,
    horizon: int | None = None,
    selftest: bool = False,
    no_float: bool = False,
    operator: str | None = None,
    band: tuple[float, float] | None = None,
    tunable: bool = False,
    fmi: int | None = None,
    force: bool = False,
) -> Generated:
    """Write C for a controller into the folder ``out``, whole or not at all; what an earlier run wrote there
    for it and this one does not, goes.

    ``controller`` is a :class:`Controller`, the path of its file, or a dictionary like it. ``arithmetic``
    (f64, f32, q31, q15), ``memory`` ("short" or "exponential"), ``length`` (past samples) of the one,
    ``tolerance`` (1e-8 … 0.1) and ``horizon`` (100 … 1e8 samples) of the other, ``operator`` and ``band``,
    and ``name`` (a C identifier) default to the controller's own. ``selftest`` adds NAME_selftest.c and .h.
    ``target`` names a core whose own instructions the history sums shall use; without it they take their
    portable form. The bits are the same. ``no_float`` leaves the conversions from and to physical values out
    of the header. ``operator`` "continuous" fits the exponential memory to (jω)^α itself within ``tolerance``
    over ``band`` (rad/s; without one four decades up to a tenth of the Nyquist frequency). It then has no
    horizon, and a tolerance of 1e-3 unless another is given. "gl" fits it to the weights of eq. (11).
    ``tunable`` adds NAME_params, NAME_default, NAME_check and NAME_tune: factors on the gains and output
    limits that change at run time, within the box that the controller's ``tunable`` gives. ``for_`` adds what
    an ecosystem expects: one of ``PACKAGES``; the interface of an "fmu" is version ``fmi``, 2 or 3 (the
    default). ``force`` replaces files also where they are not as an earlier run has written them.

    Raises ControllerError for a file that cannot be read, PlanError where the controller cannot be realised
    in this arithmetic, BuildError where an FMU finds no C compiler. InputError: a name or an option that
    cannot be used, a folder that cannot be written, or one where a file would replace the controller's own by
    other bytes, or what somebody has edited. So is one with a controller whose name differs in capitals only.
    """
    wanted = check_package(for_, fmi)
    kernels = _kernels(target)
    text, made, where = _source(controller)
    _check(arithmetic, memory)
    _check_length(*((f"{where} [length]", made.length) if length is None else ("--length", length)))
    form = made.memory if memory is None else memory
    _check_form(form, length, tolerance, horizon)
    own = made.operator if form == "exponential" else "gl"
    _check_operator(form, own if operator is None else operator, band, horizon, made.sample_time)
    called = check_name(made.name if name is None else name, where)
    plan = build_plan(made, arithmetic, length, called, memory, tolerance, horizon, operator, band, tunable)
    files = folder_files(plan, text, selftest, kernels, not no_float, wanted)
    files.update(archived(plan.name, files, wanted.fmi))
    check_told_apart(Path(out), called)
    placed = {**kept(Path(out), called), **files}
    write_files(out, placed, [controller], lambda: _going(Path(out), called, placed, controller, force))
    return Generated(Path(out), tuple(files), plan, json.loads(files["manifest.json"]))


def _going(
    out: Path, name: str, files: dict[str, str | bytes], controller: ControllerLike, force: bool
) -> tuple[Path, ...]:
    """What an earlier run has left; an InputError where that, or what takes its place, is somebody's work."""
    old = (*leftovers(out, name, files), *taken_back(out, name))
    check_apart(old, [controller])
    if not force:
        check_unedited(out, files, old)
    return old


def _titled(plan: Plan, controller_toml: bytes) -> Plan:
    """A plan whose controller is called as the C is, where its file has no name: the file's own name, which a
    reader takes then, is another one in the folder."""
    if "name" in parsed(controller_toml.decode("utf-8")):
        return plan
    return replace(plan, controller=replace(plan.controller, name=plan.name))


def folder_files(
    plan: Plan,
    controller_toml: bytes,
    selftest: bool = False,
    kernels: Kernels = PORTABLE,
    floats: bool = True,
    package: Package = PLAIN,
) -> dict[str, str | bytes]:
    """Name and content of every file of a generated folder; the same plan gives the same bytes. Of a package
    all but what a compiler makes.

    Raises PlanError for what C cannot express or count, InputError where the plan's name is no name in C.
    """
    plan = _titled(plan, controller_toml)
    check_name(plan.name, plan.controller.name)
    check_fits(plan)
    title, digest = plan.controller.name, sha256(controller_toml)
    runtime = {
        name: (shipped("c_runtime") / name).read_text(encoding="utf-8")
        for name in runtime_files(plan, kernels)
    }
    compiled = {
        f"{plan.name}.h": render("controller.h.jinja", header_context(plan, title, digest, kernels, floats)),
        f"{plan.name}.c": render("controller.c.jinja", source_context(plan, title, digest, kernels)),
        **runtime,
        **(selftest_files(plan, digest) if selftest else {}),
    }
    beside = {
        "README.md": render("README.md.jinja", readme_context(plan, title, selftest, kernels, floats)),
        "example/main.c": render("main.c.jinja", example_context(plan, title, floats)),
    }
    made = Made(plan, compiled, package.name, package.fmi)
    files = {**compiled, "controller.toml": controller_toml, **packed(beside, made)}
    inputs = {"controller.toml": digest, **{name: sha256(content) for name, content in runtime.items()}}
    manifest = manifest_of(plan, inputs, selftest, kernels, floats)
    if package != PLAIN:
        manifest["package"] = package.entry
    manifest["files"] = {name: sha256(content) for name, content in sorted(files.items())}
    return {**files, "manifest.json": _json(manifest)}


def _json(manifest: dict[str, Any]) -> str:
    return json.dumps(manifest, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def _source(controller: ControllerLike) -> tuple[bytes, Controller, str]:
    """The file's content, the controller, and what errors call it."""
    made = controller_from(controller)
    if isinstance(controller, (str, Path)):
        return Path(controller).read_bytes(), made, str(controller)
    return controller_text(made).encode("utf-8"), made, made.name


def _check(arithmetic: str | None, memory: str | None) -> None:
    if arithmetic is not None:
        check_choice("--arithmetic", arithmetic, ARITHMETICS)
    if memory is not None:
        check_choice("--memory", memory, MEMORIES)


def _check_length(where: str, length: int) -> None:
    """Raise InputError for a length that C cannot count, ``where`` being what it comes from."""
    if not isinstance(length, int) or isinstance(length, bool) or length < 1:
        raise InputError(where, f"is {length!r}", "give a memory length of at least 1 sample")
    if length > LONGEST:
        raise InputError(where, f"is {length}, more than the ring in C can count", f"give at most {LONGEST}")


def _kernels(target: str | None) -> Kernels:
    if target is not None:
        check_choice("--target", target, TARGETS)
    return Kernels(target)


def _check_form(memory: str, length: int | None, tolerance: float | None, horizon: int | None) -> None:
    """Options of the other memory form are refused, never ignored."""
    for option, value in (("--tolerance", tolerance), ("--horizon", horizon)):
        if memory == "short" and value is not None:
            raise InputError(option, "belongs to --memory exponential", "add that, or use --length")
    if memory == "exponential" and length is not None:
        raise InputError("--length", "belongs to --memory short", "use --tolerance and --horizon")
    if tolerance is not None and not TOLERANCES[0] <= tolerance <= TOLERANCES[1]:
        raise InputError("--tolerance", f"is {tolerance:g}", f"give {TOLERANCES[0]:g} to {TOLERANCES[1]:g}")
    if horizon is not None and not (isinstance(horizon, int) and HORIZONS[0] <= horizon <= HORIZONS[1]):
        raise InputError("--horizon", f"is {horizon!r}", f"give {HORIZONS[0]} to {HORIZONS[1]} samples")


def _check_operator(
    memory: str, operator: str, band: tuple[float, float] | None, horizon: int | None, step: float
) -> None:
    """The band is in rad/s; ``step`` is the sample time in s."""
    check_choice("--operator", operator, OPERATORS)
    if operator == "gl":
        if band is not None:
            raise InputError("--band", "belongs to --operator continuous", "add that, or leave it out")
        return
    if memory != "exponential":
        raise InputError("--operator", "continuous needs exponential memory", "add --memory exponential")
    if horizon is not None:
        raise InputError("--horizon", "belongs to --operator gl", "use --band, which the error is told of")
    if band is None:
        return
    low, high, highest = *band, HIGHEST / step
    if not (0.0 < low < high <= highest and RATIOS[0] <= high / low <= RATIOS[1]):
        remedy = f"give two frequencies in rad/s, a factor of {RATIOS[0]:g} to {RATIOS[1]:g} apart"
        what = f"is {low:g} to {high:g}"
        raise InputError("--band", what, f"{remedy}, up to {highest:.6g}, half of the Nyquist frequency")
