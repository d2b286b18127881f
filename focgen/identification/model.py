"""What identification finds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from focgen.identification.integer import IntegerFit
from focgen.rig.model import Rig

Span = tuple[float, float]


@dataclass(frozen=True, eq=False)
class ExperimentFit:
    """K/(T s^alpha + 1) fitted to one experiment.

    ``K`` in output per pressure units, ``T`` in s^alpha, ``level`` the pressure it was stepped to, or
    released from; ``ci95`` maps K, T and alpha to 95 % intervals. ``fitted`` and ``driven_by`` are the roles
    fitted and driving.
    ``time`` (n,) in s, ``pressure``, ``measured`` and ``simulated`` (n,). ``step`` says whether it is a step,
    which K(p) is drawn through.
    """

    name: str
    K: float
    T: float
    alpha: float
    offset: float
    level: float
    ci95: dict[str, Span]
    gof: float
    fitted: str
    driven_by: str
    time: np.ndarray
    pressure: np.ndarray
    measured: np.ndarray
    simulated: np.ndarray
    integer: tuple[IntegerFit, ...]
    step: bool


@dataclass(frozen=True, eq=False)
class Pooled:
    """One T and alpha for all steps, and the gain polynomial through their K.

    ``ci95`` maps T, alpha and gain to 95 % intervals, ``K`` (with intervals ``K_ci95``) belongs to the steps
    in order.
    """

    T: float
    alpha: float
    gain: tuple[float, ...]
    gain_r2: float
    ci95: dict[str, Span | tuple[Span, ...]]
    K: tuple[float, ...]
    K_ci95: tuple[Span, ...]
    simulated: dict[str, np.ndarray]


@dataclass(frozen=True, eq=False)
class Unseen:
    """A log that was not fitted beside the identified rig's answer, all (n,); ``swings``: it is no step."""

    name: str
    pressure: np.ndarray
    measured: np.ndarray
    simulated: np.ndarray
    gof: float
    swings: bool


@dataclass(frozen=True, eq=False)
class Identification:
    """The identified ``rig``, what it rests on, and how it compares with integer-order models.

    ``gof`` maps a model ("fom", "iom_1p", …, "rig" for the pooled one) to experiment → GOF, with "mean";
    ``bic`` likewise for Schwarz's criterion (smaller is better). ``warnings``: what these logs cannot show.
    ``unseen``: logs it was not fitted to.
    """

    experiments: tuple[ExperimentFit, ...]
    pooled: Pooled
    rig: Rig
    gof: dict[str, dict[str, float]]
    bic: dict[str, dict[str, float]]
    warnings: tuple[str, ...]
    notes: tuple[str, ...]
    unseen: tuple[Unseen, ...] = ()
