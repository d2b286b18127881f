"""The command line: one small file a command, each with EXAMPLE, add_arguments(parser) and run(args)."""

import os

# One thread for linear algebra unless told otherwise: its sums are short, and threads that wait for each
# other take twice the time. Said before anything loads it.
for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")
