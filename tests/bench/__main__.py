"""Run every benchmark, or those named."""

import argparse
import importlib
import pkgutil

import tests.bench


def main() -> None:
    names = sorted(m.name for m in pkgutil.iter_modules(tests.bench.__path__) if not m.name.startswith("_"))
    parser = argparse.ArgumentParser(prog="python -m tests.bench", description=tests.bench.__doc__)
    parser.add_argument(
        "names", nargs="*", metavar="NAME", help="all of them by default: " + ", ".join(names)
    )
    wanted = parser.parse_args().names or names
    unknown = sorted(set(wanted) - set(names))
    if unknown:
        parser.error(f"there is no benchmark {', '.join(unknown)}")
    for name in wanted:
        module = importlib.import_module(f"tests.bench.{name}")
        if hasattr(module, "run"):
            print(module.run(), flush=True)
            print()


if __name__ == "__main__":
    main()
