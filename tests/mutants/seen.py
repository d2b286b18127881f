"""A pytest plug-in: what each test runs and reads, and how long it takes.

Under ``coverage run`` every test is a context of its own, so that a line knows its tests. What is opened of
``templates/`` and ``c_runtime/`` is written beside it, a JSON line a test, to the file that ``FOCGEN_SEEN``
names. What is kept between calls is forgotten ahead of each file of tests: else only the first of them would
be seen to need it.
"""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
_WATCHED = tuple(str(ROOT / folder) + os.sep for folder in ("templates", "c_runtime"))
_opened: set[str] = set()
_failed: set[str] = set()


def _listen(event: str, arguments: tuple) -> None:
    if event == "open" and isinstance(arguments[0], str) and arguments[0].startswith(_WATCHED):
        _opened.add(os.path.relpath(arguments[0], ROOT))


sys.addaudithook(_listen)


def pytest_runtest_logreport(report):
    """What did not pass, skipped or failed, tells of nothing."""
    if report.outcome != "passed":
        _failed.add(report.outcome)


def _seconds() -> float:
    """Of the processor, those of processes that have ended included: a busy machine counts no more."""
    return sum(os.times()[:4])


def _forget(everything: bool) -> None:
    """Empty the caches of functions of the package; else those of templates alone."""
    modules = [m for name, m in list(sys.modules.items()) if name.startswith("focgen.")]
    for module in modules:
        if everything or module.__name__ == "focgen.codegen.render":
            for value in list(vars(module).values()):
                if callable(getattr(value, "cache_clear", None)):
                    value.cache_clear()


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_protocol(item, nextitem):
    """Every test in a context of its own."""
    _forget(everything=getattr(pytest_runtest_protocol, "file", None) != item.path)
    pytest_runtest_protocol.file = item.path
    if "coverage" in sys.modules and (measured := sys.modules["coverage"].Coverage.current()):
        measured.switch_context(item.nodeid)
    _opened.clear()
    _failed.clear()
    begin = _seconds()
    yield
    line = {"test": item.nodeid, "seconds": round(_seconds() - begin, 4), "files": sorted(_opened)}
    if _failed:
        line["failed"] = sorted(_failed)
    with open(os.environ["FOCGEN_SEEN"], "a", encoding="utf-8") as out:
        out.write(json.dumps(line) + "\n")
