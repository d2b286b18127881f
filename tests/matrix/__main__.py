"""``python -m tests.matrix``: makes every form under every setting that there is here, and compares bytes."""

from __future__ import annotations

import argparse
import itertools
import sys
from collections.abc import Iterator
from pathlib import Path

from tests.matrix.settings import ENVIRONMENTS, PLAIN, VERSIONS, Setting, digests, installed


def main() -> int:
    given = argparse.ArgumentParser(prog="make matrix")
    given.add_argument("--folder", type=Path, default=Path("build/matrix"))
    given.add_argument("--pythons", nargs="*", default=list(VERSIONS), choices=list(VERSIONS))
    asked = given.parse_args()
    folder = asked.folder.resolve()
    here = digests(PLAIN, folder / "files")
    print(f"{len(here)} files, as it is: {PLAIN.python}")
    print("| setting | files that differ |\n|---|---|")
    settings = itertools.chain(ENVIRONMENTS, _pythons(asked.pythons, folder))
    return int(any(_differs(setting, here, folder / "files") for setting in settings))


def _pythons(versions: list[str], folder: Path) -> Iterator[Setting | str]:
    """Each is installed when its turn comes, in a folder of its own, where it stays."""
    for version in versions:
        for i, packages in enumerate(VERSIONS[version]):
            yield installed(version, packages, folder / f"{version}-{i}")


def _differs(setting: Setting | str, here: dict[str, str], folder: Path) -> bool:
    """Print a row; whether a file differs."""
    found = setting if isinstance(setting, str) else digests(setting, folder)
    if isinstance(found, str):
        name = "–" if isinstance(setting, str) else setting.name
        print(f"| {name} | not tried: {found} |", flush=True)
        return False
    wrong = sorted(name for name in here.keys() | found.keys() if here.get(name) != found.get(name))
    print(f"| {setting.name} | {', '.join(wrong) or 'none'} |", flush=True)
    return bool(wrong)


if __name__ == "__main__":
    sys.exit(main())
