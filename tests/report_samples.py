"""A diagnosis made up by hand, with names that are no friends of HTML, TeX or the plotting library."""

import numpy as np

from focgen.diagnosis.drawn import Drawn, Mean, Rivals, SegmentError, Trace
from focgen.diagnosis.model import Candidate, Diagnosis, Estimate, Found, Gap, NextExperiment, PlainFit, Where

NAMES = ("<script>alert(1)</script>", '$$\\alpha$$ & @x{y} "q"</title>')


def diagnosis() -> Diagnosis:
    """One effect, and one that is tied with it."""
    parameters = {"width": Estimate(0.4, (0.3, 0.5), "pressure unit")}
    candidates = (
        Candidate("hysteresis", "actuator", 0.8, "play", parameters, 0.0),
        Candidate("friction", "actuator", 0.15, "coulomb", {}, 0.7),
    )
    gof = {"as given": 0.5, "refitted": 0.6, "explained": 0.9, "possible": 0.95}
    return Diagnosis(
        verdict="set",
        where=Where("actuator", False, {"regulator": 0.0, "actuator": 1.0, "sensor": 0.0}, {}),
        causes=(Found("actuator", candidates, 0.9, (0.8, 0.95)),),
        gap=Gap(1.0, 0.8, 0.3, 0.1, "mm", gof),
        shrink=0.9,
        shrink_interval=(0.8, 0.95),
        refitted_rig="refitted.toml",
        augmented_rig="augmented.toml",
        next_experiment=NextExperiment("the two differ in it", "a slow sine", 3.0),
        unexplained={},
        notes=(f"{NAMES[0]} was bridged",),
        fits=(PlainFit("hysteresis", 0.4),),
        warnings=(),
    )


def signals(count: int = 2000) -> Drawn:
    """Two experiments of ``count`` samples; the second has a peak of 9 in one sample."""
    time = np.arange(count) * 0.05
    x = 1.0 + np.sin(0.2 * time)
    made = np.cos(0.2 * time)
    peaked = made.copy()
    peaked[count // 3] = 9.0
    traces = tuple(
        Trace(name, 1000.0 * i, time, x, y, 0.5 * made, 0.8 * made, made)
        for i, (name, y) in enumerate(zip(NAMES, (made, peaked)))
    )
    at = np.linspace(0.0, 2.0, 10)
    kept = (("level", "rising"), ("level", "falling"), ("rate", "any"), ("time", "any"))
    means = tuple(Mean(over, way, of, at, at - 1.0) for of in ("refitted", "explained") for over, way in kept)
    return Drawn(
        entry="pressure",
        units={"command": "V", "pressure": "bar", "curvature": "mm", "output": "mm"},
        samples=2 * count,
        kept=2 * count,
        traces=traces,
        segments=(SegmentError("pressure", "output", 10.0, 8.0, 3.0),),
        worst=("pressure", "output"),
        means=means,
        rivals=(Rivals("hysteresis", ("hysteresis", "friction", "creep"), (0.0, 0.7, 8.0)),),
    )
