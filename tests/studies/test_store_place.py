"""Where a study keeps its answers: in its own folder, wherever links lead.

Red when an answer is written outside of the study.
"""

from types import SimpleNamespace

import pytest

from focgen.errors import InputError
from focgen.studies.store import Store


def test_no_answer_is_kept_outside_of_the_study(tmp_path):
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "study").mkdir()
    (tmp_path / "study" / "rows").symlink_to(tmp_path / "elsewhere")
    job = SimpleNamespace(key="0" * 64)
    with pytest.raises(InputError, match="leads out of"):
        Store(tmp_path / "study").keep(job, {"row": 1.0})
    assert not list((tmp_path / "elsewhere").iterdir())
    (tmp_path / "study" / "rows").unlink()
    store = Store(tmp_path / "study")
    assert store.keep(job, {"row": 1.0}) == store.find(job) == {"row": 1.0}
