"""What was compared, counted: by target and by kind; and bounds beside the worst errors."""

from __future__ import annotations

from collections import Counter

import numpy as np

ARITHMETICS = ("q15", "q31", "f32", "f64")


def table(results: list[dict]) -> str:
    """Markdown: what ran where, of which kinds, and how loose the bounds are."""
    return "\n\n".join([_by_target(results), _by_kind(results), _by_bound(results), *_wrong(results)])


def _by_target(results: list[dict]) -> str:
    lines = [
        "| runs on | controllers | samples | differing | a bound exceeded | samples a second |",
        "|---|---|---|---|---|---|",
    ]
    for target in dict.fromkeys(r["target"] for r in results):
        own = [r for r in results if r["target"] == target]
        samples, seconds = sum(r["samples"] for r in own), sum(r["seconds"] for r in own)
        counts = sum(r["differing"] for r in own), sum(not r["within"] for r in own)
        rate = samples / max(seconds, 1e-9)
        lines.append(f"| {target} | {len(own)} | {samples:.4g} | {counts[0]} | {counts[1]} | {rate:.3g} |")
    return "\n".join(lines)


def _by_kind(results: list[dict]) -> str:
    host = [r for r in results if r["target"] == "host"]
    counts = Counter(k for r in host for k in (r["arithmetic"], r["kind"].replace("_", " "), *r["kinds"]))
    return (
        "Controllers on the host: "
        + ", ".join(f"{count} {kind}" for kind, count in counts.most_common())
        + "."
    )


def _by_bound(results: list[dict]) -> str:
    lines = [
        (
            "| arithmetic | controllers | bound / worst error: least | median | nine of ten below | loosest "
            "| which, and its largest part |"
        ),
        "|---|---|---|---|---|---|---|",
    ]
    for arithmetic in ARITHMETICS:
        own = [
            r for r in results if r["target"] == "host" and r["arithmetic"] == arithmetic and r["share"] > 0.0
        ]
        if own:
            ratios = np.array([1.0 / r["share"] for r in own])
            loosest = own[int(np.argmax(ratios))]
            numbers = (ratios.min(), np.median(ratios), np.quantile(ratios, 0.9), ratios.max())
            row = " | ".join(f"{x:.3g}" for x in numbers)
            lines.append(
                f"| {arithmetic} | {len(own)} | {row} "
                f"| {loosest['kind']} {loosest['seed']}: {loosest['cause']} |"
            )
    return "\n".join(lines)


def _wrong(results: list[dict]) -> list[str]:
    return [
        f"seed {r['seed']}, {r['kind']} in {r['arithmetic']} on {r['target']}: {r['differing']} differing, "
        f"{1.0 / max(r['share'], 1e-300):.3g} of its bound. {r['first']}"
        for r in results
        if r["differing"] or not r["within"]
    ]
