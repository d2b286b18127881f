"""The corpus that the tests keep: of each target the few inputs that show every branch that any has shown."""

from __future__ import annotations

import base64
import json
from collections.abc import Sequence
from pathlib import Path

from tests.fuzz.campaign import Campaign, Group

FOLDER = Path(__file__).with_name("corpus")
_LONGEST = 1600  # bytes of an input that is kept
_MOST = 40


def known() -> dict[str, list[bytes]]:
    """The inputs by target."""
    return {
        path.stem: list(map(_bytes, json.loads(path.read_text("utf-8"))))
        for path in sorted(FOLDER.glob("*.json"))
    }


def keep(groups: Sequence[Group], folder: Path) -> int:
    """Write the corpus of a campaign's folder anew."""
    for group in groups:
        campaign = Campaign(group, folder, 0, known())
        group.prepare(campaign.guidance)
        campaign.guidance.begin()
        for target in group.targets:
            chosen = _least(campaign, target)
            if chosen:
                FOLDER.mkdir(exist_ok=True)
                text = json.dumps(list(map(_text, chosen)), indent=0, ensure_ascii=True)
                (FOLDER / f"{target.name}.json").write_text(text + "\n", "utf-8")
                print(target.name, len(chosen), "inputs,", sum(map(len, chosen)), "bytes")
        campaign.guidance.end()
    return 0


def _least(campaign: Campaign, target) -> list[bytes]:
    """The shortest inputs first, each that shows what no shorter one did; the target's own seeds are there
    anyway."""
    campaign.guidance.forget()
    for data in target.seeds():
        campaign._one(target, data)
    candidates = sorted(
        {d for d in campaign.corpora[target.name] if len(d) <= _LONGEST}, key=lambda d: (len(d), d)
    )
    return [data for data in candidates if campaign._one(target, data)][:_MOST]


def _text(data: bytes) -> str:
    """As it stands where it is ASCII, else in base 64."""
    return data.decode() if data.isascii() else "base64:" + base64.b64encode(data).decode()


def _bytes(text: str) -> bytes:
    return base64.b64decode(text[7:]) if text.startswith("base64:") else text.encode()
