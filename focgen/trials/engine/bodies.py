"""The body of a rig as a model of the engine: hinges with springs and dampers, and what is added to them.

Torques are counted in what bends the healthy body by one radian, so that its stiffness is 1; angles are in
radians, times in s.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

_GRAVITY = 9.81  # m/s²
_ARM = 0.02  # m from the hinge to a heavy tip: short, so that it adds little inertia
_SPECK = 1e-5  # kg: no body of the engine may be without mass


@dataclass(frozen=True)
class Body:
    """A healthy body: ``links`` hinges in a row that share the angle evenly; ``time`` its damping over its
    stiffness, ``inertia`` in units of stiffness times ``time`` squared; ``filter`` the motor's own lag."""

    links: int
    time: float
    inertia: float
    filter: float = 0.0


@dataclass(frozen=True)
class Series:
    """One more hinge whose angle is seen as well, with a spring ``stiffness``, a damper and an ``inertia``;
    ``driven``: the motor bends it, too; ``carried``: it sits at the end of the row and shakes that."""

    stiffness: float
    damping: float
    inertia: float
    driven: bool
    carried: bool


@dataclass(frozen=True)
class Link:
    """A second body that the first one takes along: where it lies between ``low`` and ``high`` of it, nothing
    holds it but dry ``friction`` and a ``stiffness`` of its own. It is what is seen."""

    low: float
    high: float
    friction: float
    stiffness: float
    damping: float


@dataclass(frozen=True)
class Parts:
    """What effects add to a body.

    ``bends``: stiffness 1 + a |angle| + b angle². ``tip``: the torque of a heavy tip, and where it hangs in
    radians. ``friction``: dry. ``preload``: angle by which the spring is pressed against a stop at zero.
    ``stop``: largest angle. ``bumper``: angle from which a second spring pushes back, and its stiffness.
    ``slip``: a spring beside, and the torque at which it slips.
    """

    bends: tuple[float, float] = (0.0, 0.0)
    tip: tuple[float, float] = (0.0, 0.0)
    friction: float = 0.0
    preload: float = 0.0
    stop: float | None = None
    bumper: tuple[float, float] | None = None
    slip: tuple[float, float] | None = None
    series: Series | None = None
    link: Link | None = None


def model_text(body: Body, parts: Parts, h: float) -> str:
    """The engine's model, stepping by ``h`` s. Its motor is number 0; tendon ``seen`` is the angle."""
    return "".join(
        (
            '<mujoco><compiler angle="radian" autolimits="true"/>',
            f'<option timestep="{h:g}" integrator="implicitfast" gravity="{_down(parts)}">',
            '<flag contact="disable"/></option><worldbody>',
            *_hinges(body, parts),
            *_beside(body, parts),
            "</worldbody><tendon>",
            *_tendons(body, parts),
            "</tendon><actuator>",
            _motor(body),
            "</actuator></mujoco>",
        )
    )


def _down(parts: Parts) -> str:
    """The direction in which the tip falls: it hangs where the angle is less than zero by ``tip[1]``."""
    weight, phase = parts.tip
    g = _GRAVITY * np.sign(weight)
    return f"{g * np.cos(phase):.9g} 0 {g * np.sin(phase):.9g}"


def _hinges(body: Body, parts: Parts) -> Iterator[str]:
    count, weight = body.links, abs(parts.tip[0])
    inertia = body.inertia * body.time**2
    for i in range(count):
        last = i == count - 1
        mass = weight / (_GRAVITY * _ARM * count) if last and weight else _SPECK
        yield f'<body pos="{_ARM if i else 0:g} 0 0">' + _hinge(body, parts, i, count * inertia)
        yield f'<inertial pos="{_ARM:g} 0 0" mass="{mass:.9g}" diaginertia="1e-7 1e-7 1e-7"/>'
    if parts.series and parts.series.carried:
        yield _more(parts.series)
    yield "</body>" * count
    if parts.series and not parts.series.carried:
        yield _more(parts.series)


def _more(own: Series) -> str:
    return (
        f'<body><joint name="s" axis="0 1 0" stiffness="{own.stiffness:.9g}" damping="{own.damping:.9g}"/>'
        f'<inertial pos="0 0 0" mass="{_SPECK}" diaginertia="{" ".join([f"{own.inertia:.9g}"] * 3)}"/></body>'
    )


def _hinge(body: Body, parts: Parts, which: int, armature: float) -> str:
    """One of the hinges: it bends by its share of the angle, so it is as many times as stiff."""
    n, (a, b) = body.links, parts.bends
    rest = -parts.preload / n + (parts.tip[0] * np.sin(parts.tip[1]) if n == 1 else 0.0)
    text = f'<joint name="h{which}" axis="0 1 0" stiffness="{n:.9g} {n * n * a:.9g} {n**3 * b:.9g}"'
    text += f' damping="{n * body.time:.9g}" armature="{armature:.9g}" springref="{rest:.9g}"'
    if parts.friction:
        text += f' frictionloss="{parts.friction:.9g}" solimpfriction="0.9999 0.9999 0.001"'
    low, high = 0.0 if parts.preload else -10.0, 10.0 if parts.stop is None else parts.stop
    if parts.preload or parts.stop is not None:
        text += f' range="{low / n:.9g} {high / n:.9g}"'
    return text + "/>"


def _beside(body: Body, parts: Parts) -> Iterator[str]:
    """Bodies that are not in the row: what it takes along, and what slips."""
    inertia = f'<inertial pos="0 0 0" mass="{_SPECK}" diaginertia="1e-7 1e-7 1e-7"/></body>'
    grip = 'solimpfriction="0.9999 0.9999 0.001"'
    if parts.link:
        own = parts.link
        yield (
            f'<body><joint name="l" axis="0 1 0" stiffness="{own.stiffness:.9g}" damping="{own.damping:.9g}"'
            f' frictionloss="{own.friction:.9g}" {grip} armature="1e-3"/>{inertia}'
        )
    if parts.slip:
        yield (
            f'<body><joint name="g" axis="0 1 0" frictionloss="{parts.slip[1]:.9g}" {grip} damping="1e-3"'
            f' armature="1e-3"/>{inertia}'
        )


def _tendons(body: Body, parts: Parts) -> Iterator[str]:
    row = _joints([f"h{i}" for i in range(body.links)])
    series = _joints(["s"]) if parts.series else ""
    driven = series if parts.series and parts.series.driven else ""
    yield f'<fixed name="pulled">{row}{driven}</fixed>'
    yield f'<fixed name="seen">{_joints(["l"]) if parts.link else row + series}</fixed>'
    if parts.bumper:
        at, stiffness = parts.bumper
        yield f'<fixed stiffness="{stiffness:.9g}" springlength="-10 {at:.9g}">{row}</fixed>'
    if parts.link:
        ends = f"{parts.link.low:.9g} {parts.link.high:.9g}"
        apart = _joints(["l"]) + _joints([f"h{i}" for i in range(body.links)], -1)
        yield f'<fixed range="{ends}">{apart}</fixed>'
    if parts.slip:
        apart = row + _joints(["g"], -1)
        yield f'<fixed stiffness="{parts.slip[0]:.9g}" springlength="0">{apart}</fixed>'


def _joints(names: list[str], sign: int = 1) -> str:
    return "".join(f'<joint joint="{name}" coef="{sign}"/>' for name in names)


def _motor(body: Body) -> str:
    if not body.filter:
        return '<motor tendon="pulled"/>'
    return f'<general tendon="pulled" dyntype="filterexact" dynprm="{body.filter:.9g}" gainprm="1"/>'
