"""Speed and bias, each beside its rivals in one run: ``python -m tests.bench [NAME …]``.

Every module here that has ``run() -> str`` prints a table. Times depend on the machine; the ratios are what
to read.
"""
