"""Where the C templates, the C runtime and the examples are, in a checkout or in an installed wheel."""

from pathlib import Path

_PACKAGE = Path(__file__).resolve().parent


def shipped(folder: str) -> Path:
    """Return the folder ``templates``, ``c_runtime`` or ``examples``.

    A wheel carries them inside the package; a checkout has them beside it.
    """
    packed = _PACKAGE / "_shipped" / folder
    return packed if packed.is_dir() else _PACKAGE.parent / folder
