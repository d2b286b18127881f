"""A pure delay of any length, shared by the families that have one."""

import numpy as np


def delayed(x, delay, run):
    """``x`` (n,) later by ``delay`` s, linear between samples, each experiment from rest."""
    back = delay / run.h
    whole, part = int(back), back % 1.0
    nearer, further = np.zeros_like(x), np.zeros_like(x)
    for first, last in run.spans:
        nearer[first + whole : last] = x[first : max(last - whole, first)]
        further[first + whole + 1 : last] = x[first : max(last - whole - 1, first)]
    return (1.0 - part) * nearer + part * further
