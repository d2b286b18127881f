"""History sums that look four samples ahead: how the weights are laid out and the work is shared out.

The sums of four successive steps, a *group*, are taken together, so that each load of a weight and of a
sample serves four products; ``foc_ahead_q15.h`` and its like do it. The samples known when the group before
it began are its far part, lags 16 and more (8 and more in floating point); a quarter of that work is done in
each of that group's four steps. The near lags are summed in their own step.

A block of lags ``first`` … ``last`` becomes tiles of four samples times four sums. With the group in the
making beginning at sample T, its tiles cover samples T − 4·back … T − 4·(first // 4) + 3, where
back = ⌈last / 4⌉; sum i takes weight [j + 4 − i] for sample j, so that weight q belongs to lag
4·back + 4 − q, and is 0 outside the block.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from focgen.plan.plan import Block, Count, Sum

AHEAD = 4
NEAR, NEAR_FLOATING = 16, 8  # lags summed in their own step; 8 at least, as the others are not known before
SHORTEST = 8  # far lags below which looking ahead does not pay
_LONGEST = 65_000  # lags: a ring of whole groups is counted in 16 bits
_WEIGHTS, _RUNS = 65_535, 255  # with the zeros that fill up blocks; what foc_run and the slices count
_WIDEST = 31  # bits that a block may be shifted by
_RUN = 4  # what a run costs beside its tiles, in tiles: calls, the ring's end, rounding


@dataclass(frozen=True)
class Run:
    """Tiles of one block in one step: where its weights begin, how many tiles, how many tiles the oldest is
    before the group in the making, the block's shift, and whether the block ends with it."""

    weights: int
    tiles: int
    back: int
    shift: int
    ends: bool


@dataclass(frozen=True)
class LookAhead:
    """A sum in two parts: the ``far`` blocks with their padded ``weights`` (oldest first, block by block),
    the ``runs`` in order, of which step p does ``slices[p]`` … ``slices[p + 1]``; and the ``near`` sum, None
    where all its weights are zero."""

    far: tuple[Block, ...]
    weights: tuple[tuple[Count, ...], ...]
    runs: tuple[Run, ...]
    slices: tuple[int, ...]
    near: Sum | None

    def table_bytes(self, word: int) -> int:
        """Bytes of all its tables, with weights of ``word`` bytes."""
        weights = sum(map(len, self.weights)) + (self.near.taps if self.near else 0)
        return weights * word + 8 * len(self.runs) + len(self.slices)

    def state_bytes(self, sum_bytes: int) -> int:
        """Bytes of state beside the ring, with sums of ``sum_bytes`` bytes."""
        return (8 if self.far[0].sum.floating else 12) * sum_bytes


def look_ahead(table: Sum) -> LookAhead | None:
    """Lay a sum out; None where it is too short for that to pay, longer or in more parts than the runtime's
    tiles are counted, or shifted by more than they can."""
    near_lags = NEAR_FLOATING if table.total.floating else NEAR
    if table.last - near_lags + 1 < SHORTEST or table.last > _LONGEST:
        return None
    blocks = [part for block in table.blocks for part in _parted(block) if any(part.weights)]
    far = tuple(block for block in blocks if block.first >= near_lags)
    near = tuple(block for block in blocks if block.first < near_lags)
    if not far or any(block.align > _WIDEST for block in far):
        return None
    runs, slices = _shared([_whole(block) for block in far])
    if max(run.weights for run in runs) > _WEIGHTS or len(runs) > _RUNS:
        return None
    return LookAhead(
        far, tuple(map(_padded, far)), runs, slices, replace(table, blocks=near) if near else None
    )


def _parted(block: Block) -> list[Block]:
    """Its far and its near part. Only floating sums, which are one block without a shift, can be cut."""
    if not block.first < NEAR_FLOATING <= block.last or not block.sum.floating:
        return [block]
    cut = NEAR_FLOATING - block.first
    return [
        replace(block, first=NEAR_FLOATING, weights=block.weights[cut:]),
        replace(block, last=NEAR_FLOATING - 1, weights=block.weights[:cut]),
    ]


def _back(block: Block) -> int:
    return -(-block.last // AHEAD)


def _tiles(block: Block) -> int:
    return _back(block) - block.first // AHEAD + 1


def _padded(block: Block) -> tuple[Count, ...]:
    zero = type(block.weights[0])(0)
    lags = range(AHEAD * _back(block) + AHEAD, AHEAD * (_back(block) - _tiles(block)), -1)
    return tuple(
        block.weights[lag - block.first] if block.first <= lag <= block.last else zero for lag in lags
    )


def _whole(block: Block) -> Run:
    return Run(0, _tiles(block), _back(block), block.align, True)


def _shared(blocks: list[Run]) -> tuple[tuple[Run, ...], tuple[int, ...]]:
    """Share the tiles of all blocks among four steps, so that none has much more to do than another."""
    share = (sum(run.tiles + _RUN for run in blocks) + (AHEAD - 1) * _RUN) / AHEAD
    runs: list[Run] = []
    slices, spent, at = [0], 0.0, 0
    for block in blocks:
        left = block
        while left.tiles:
            room = round(share * len(slices) - spent) - _RUN
            last = len(slices) == AHEAD
            if not last and room < 1:
                slices.append(len(runs))
                continue
            tiles = left.tiles if last else min(left.tiles, room)
            runs.append(replace(left, weights=at, tiles=tiles, ends=tiles == left.tiles))
            left = replace(left, tiles=left.tiles - tiles, back=left.back - tiles)
            at += AHEAD * tiles
            spent += tiles + _RUN
        at += AHEAD
    slices += [len(runs)] * (AHEAD + 1 - len(slices))
    return tuple(runs), tuple(slices)
