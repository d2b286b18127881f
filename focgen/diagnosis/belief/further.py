"""What speaks for one more effect: the odds of each candidate over what was found without it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from focgen.diagnosis.belief.likelihood import Scale, speaks, speaks_or_is_right
from focgen.diagnosis.fitting.fit import Fit, Weighing, answer, fit, square_by
from focgen.diagnosis.numbers import NUMBERS

_STEPS = 6  # iterations of the fit that asks
_NEAR = 2.0  # nats: nominal parameters that are closer to those given are not asked again

Rule = Callable[[int, float, float, Scale, float], float]


@dataclass(frozen=True)
class Surroundings:
    """What makes a misfit beside the forms. ``hidden``: the mean square that a coarse converter may make, as
    a share of the level's; ``lost`` (n,): a draw of what an input has lost, and ``noise`` (n,) of what stays
    in it of its noise, in its unit."""

    hidden: float = 0.0
    lost: np.ndarray | None = None
    noise: np.ndarray | None = None

    def nats(self, of: Fit, noise: float, floor: float, weighing: Weighing) -> float:
        """Beside a fit, where noise has the mean square ``noise``, a share of the level's, and the sum of
        squares ``floor`` of innovations. What the output lacks for what its input has lost is slow: it counts
        in the colour of the noise, which hides much of what is slow."""
        count = len(of.innovations)
        lost = 0.0 if self.lost is None else answer(of, self.lost, weighing)
        share = NUMBERS.other + self.hidden / max(noise, 1e-300)
        return 0.5 * count * share + _nats(lost, floor, count)


@dataclass(frozen=True, eq=False)
class Ground:
    """What candidates for one more effect are weighed against.

    ``base``: the fit without it; ``floor``: a sum of squares that only noise leaves; ``changed``: what the
    effects of ``base`` change, nats; ``scale``: of the misfit that is no wonder; ``weighing``: of residuals.

    Fits make the misfit least, each nat of it as dear as one against the nominal parameters. Here a misfit is
    judged more mildly, for every form is a little wrong. So a fit that has moved them further than noise does
    is made anew, with what is known of them weighed as much more, and the better one speaks for the
    hypothesis.

    Noise that is left in an input was not in the rig. A form that answers less to it than ``base``, as a lag,
    a dead zone or a loop does, leaves less by that alone: it is no merit (as of W. A. Fuller, Measurement
    error models, 1987, where such noise lets a slope seem smaller than it is).
    """

    base: Fit
    floor: float
    changed: float
    scale: Scale
    weighing: Weighing
    noise: np.ndarray | None = None
    _answers: dict[Fit, float] = field(default_factory=dict, init=False)
    _found: dict[Fit, Fit] = field(default_factory=dict, init=False)

    @classmethod
    def of(
        cls,
        first: Fit,
        base: Fit,
        tried: Sequence[Fit],
        weighing: Weighing,
        surroundings: Surroundings,
    ) -> Ground:
        """``first``: the fit without any effect, ``tried``: with one more than ``base``, the others maybe in
        other forms."""
        best = min([base, *tried], key=lambda f: f.sse)
        told = _told(best)
        count = len(base.innovations)
        noise = float(np.mean(best.weighed**2)) * (1.0 - told)
        floor = best.sse * (1.0 - told)
        before = square_by(first, weighing) if base.problem.candidates else base.sse
        scale = Scale(surroundings.nats(base, noise, floor, weighing))
        return cls(base, floor, _nats(before - base.sse, floor, count), scale, weighing, surroundings.noise)

    def misfit(self, of: Fit) -> float:
        """Nats by which a fit leaves more than noise, and those by which it leaves less for being deaf."""
        left = _nats(of.sse - self.floor, self.floor, len(of.innovations))
        return max(left, 0.0) + self._deaf(of)

    def _deaf(self, of: Fit) -> float:
        """Nats by which a fit answers less than ``base`` to noise of the input."""
        if self.noise is None:
            return 0.0
        less = self._answer(self.base, self.noise) - self._answer(of, self.noise)
        return max(_nats(less, self.floor, len(of.innovations)), 0.0)

    def _answer(self, of: Fit, noise: np.ndarray) -> float:
        if of not in self._answers:
            self._answers[of] = answer(of, noise, self.weighing)
        return self._answers[of]

    def odds(self, of: Fit, most: int | None = None, rule: Rule = speaks_or_is_right) -> float:
        """Log odds, before any prior, of a fit with one more effect over ``base``; at most ``most`` of its
        free values are counted. Own parameters closer to those given speak for it."""
        without = self._speaks(self._best(self.base, rule), None, rule)
        return self._speaks(self._best(of, rule), most, rule) - without

    def compared(self, of: Fit, most: int | None = None) -> float:
        """The same where fits are to be held against one another: that one of them is right by chance does
        not choose it."""
        return self.odds(of, most, speaks)

    def roughly(self, of: Fit) -> float:
        """What speaks for a fit as it is, its nominal parameters kept no closer: enough to tell forms of one
        family apart."""
        return self._speaks(of, None, speaks_or_is_right)

    def closer(self, of: Fit) -> float:
        """The nats of its odds that a fit has for nominal parameters closer to those given."""
        return max(self._best(self.base).prior_penalty - self._best(of).prior_penalty, 0.0)

    def _best(self, of: Fit, rule: Rule = speaks_or_is_right) -> Fit:
        """A fit, or the same with its nominal parameters kept closer to those given, if that speaks more."""
        if of.prior_penalty < _NEAR:
            return of
        if of not in self._found:
            self._found[of] = self._kept(of)
        return max(of, self._found[of], key=lambda f: self._speaks(f, None, rule))

    def _gained(self, of: Fit) -> float:
        return max(self.misfit(self.base) - self.misfit(of), 0.0)

    def _speaks(self, of: Fit, most: int | None, rule: Rule) -> float:
        """What speaks for a fit, nats."""
        gained, free = self._gained(of), of.size - self.base.size
        count = free if most is None else min(free, most)
        return rule(count, gained, self.misfit(of), self.scale, self.changed + gained) - of.prior_penalty

    def _kept(self, of: Fit) -> Fit:
        """A fit made anew that keeps nominal parameters closer to those given: as if each nat against them
        were as dear as the nats of misfit that are as unlikely."""
        dear = (self.scale.of(self.changed + self._gained(of)) + self.misfit(of)) / NUMBERS.turns
        return fit(replace(of.problem, weight=max(dear, 1.0)), of.vector, self.weighing, _STEPS)


def _told(best: Fit) -> float:
    """The share of what a fit leaves that is more than noise, for inputs predict it."""
    return min(max(best.predictable_share - NUMBERS.chance, 0.0), 1.0 - 1e-9)


def _nats(square: float, floor: float, count: int) -> float:
    """A sum of squares in nats of the noise."""
    return 0.5 * count * square / max(floor, 1e-300)
