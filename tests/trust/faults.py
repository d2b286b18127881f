"""What happens to a controller in its loop: one small class a fault."""

from __future__ import annotations

import numpy as np

from tests.trust.seat import Seat

LEVEL = 0.010
"""The set point while a fault lasts, in 1/mm."""
UNREACHABLE = 0.020
"""Beyond what the output's limit can hold."""


class Fault:
    """Nothing: the others say what is different between their ``begin`` and ``end`` (samples)."""

    about = "none"
    owed = ("short", "exponential")
    """With which memories the loop has to recover within the time that is given."""

    def __init__(self, begin: int, end: int, rng: np.random.Generator):
        self.begin, self.end, self.rng = begin, end, rng
        self.seen: list[float] = []

    def acts(self, k: int) -> bool:
        return self.begin <= k < self.end

    def reference(self, k: int, ref: float) -> float:
        return ref

    def measured(self, k: int, y: float) -> float:
        return y

    def scheduled(self, k: int, p: float, floating: bool) -> float:
        return p

    def before(self, k: int, seat: Seat, ref: float, y: float) -> None:
        """Of the controller's own, ahead of its step."""

    def called(self, k: int) -> bool:
        """Whether the controller gets this sample at all."""
        return True

    def applied(self, k: int, u: float, seat: Seat) -> float:
        """What reaches the regulator."""
        return u


class Stuck(Fault):
    about = "the measurement stands still"

    def measured(self, k, y):
        if k == self.begin:
            self.seen = [y]
        return self.seen[0] if self.acts(k) else y


class Spikes(Fault):
    about = "spikes of the whole range in every 20th sample"

    def measured(self, k, y):
        spike = self.acts(k) and self.rng.random() < 0.05
        return y + self.rng.choice((-1.0, 1.0)) * 0.02 if spike else y


class Missing(Fault):
    about = "every second sample is not called, at random"

    def called(self, k):
        return not (self.acts(k) and self.rng.random() < 0.5)


class NotANumber(Fault):
    about = "NaN and infinity in every third sample; of integers the ends of their type"

    def measured(self, k, y):
        odd = self.acts(k) and self.rng.random() < 1 / 3
        return float(self.rng.choice((np.nan, np.inf, -np.inf))) if odd else y


class Late(Fault):
    about = "the measurement comes 0.1 s late"

    def measured(self, k, y):
        self.seen.append(y)
        return self.seen[max(0, k - 10)] if self.acts(k) else y


class Flips(Fault):
    about = "a bit of the state flips, ten times"

    def before(self, k, seat, ref, y):
        if self.acts(k) and (k - self.begin) % max(1, (self.end - self.begin) // 10) == 0:
            seat.damage(self.rng, 1)


class AnyState(Fault):
    """What the interface forbids. A finite output within its limits is owed all the same; but the means of an
    exponential memory, full of numbers that no past can leave, take as long as they do to forget them."""

    about = "power-on without init, the state being random"
    owed = ("short",)

    def before(self, k, seat, ref, y):
        if k == self.begin:
            seat.damage(self.rng, None)


class Zeroed(Fault):
    about = "power-on without init, the state all zeros as a start of C leaves it"

    def before(self, k, seat, ref, y):
        if k == self.begin:
            seat.zero()


class Restarted(Fault):
    about = "power-on with init, the state having been random"

    def before(self, k, seat, ref, y):
        if k == self.begin:
            seat.damage(self.rng, None)
            seat.init()


class ScheduleLost(Fault):
    about = "the scheduling signal is 0, or NaN in floats"

    def scheduled(self, k, p, floating):
        return p if not self.acts(k) else float("nan") if floating and k % 2 else 0.0


class Saturation(Fault):
    about = "a set point that the limits do not reach"

    def reference(self, k, ref):
        return UNREACHABLE if self.acts(k) else ref


class Jumps(Fault):
    about = "the set point jumps anywhere, every 0.2 s"

    def reference(self, k, ref):
        if not self.acts(k):
            return ref
        if (k - self.begin) % 20 == 0:
            self.seen = [float(self.rng.uniform(0.0, UNREACHABLE))]
        return self.seen[0]


class Manual(Fault):
    about = "by hand and back, every 0.5 s; tracked"

    def applied(self, k, u, seat):
        if not self.acts(k) or (k - self.begin) // 50 % 2:
            return u
        seat.track(0.8)
        return 0.8


class BrownOut(Fault):
    about = "power fails for 0.3 s; restored from 0.1 s before"

    def before(self, k, seat, ref, y):
        if k == self.begin - 10:
            seat.save()
        if k == self.begin + 30:
            seat.restore()

    def called(self, k):
        return not self._off(k)

    def applied(self, k, u, seat):
        return 0.0 if self._off(k) else u

    def _off(self, k):
        return self.begin <= k < self.begin + 30


class DeadRegulator(Fault):
    about = "the regulator gives no pressure, and nobody says so"

    def applied(self, k, u, seat):
        return 0.0 if self.acts(k) else u


FAULTS = (Fault, Stuck, Spikes, Missing, NotANumber, Late, Flips, AnyState, Zeroed,
          Restarted, ScheduleLost, Saturation, Jumps,
          Manual, BrownOut, DeadRegulator)  # fmt: skip
