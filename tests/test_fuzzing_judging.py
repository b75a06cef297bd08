"""The judge of all inputs sees what no input may do."""

import pytest
from fuzzing import judging


def test_an_exception_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    """What is no ValueError or OSError is no answer to whoever reads a folder."""
    monkeypatch.setitem(judging.READERS, "load_result", lambda folder: {}[folder])
    assert "KeyError: 'run'" in judging.ending(["load_result", "run"]).why


def test_what_hangs_is_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever does not end by itself is ended."""

    def forever(folder: str) -> None:
        while True:
            pass

    monkeypatch.setattr(judging, "HANGS_S", 0.2)
    monkeypatch.setitem(judging.READERS, "load_result", forever)
    assert judging.ending(["load_result", "run"]).why.startswith("hangs")


@pytest.mark.skipif(not judging.STATM.exists(), reason="memory is limited on Linux only")
def test_too_much_memory_is_not_given(monkeypatch: pytest.MonkeyPatch) -> None:
    """More than a gigabyte is refused."""
    monkeypatch.setitem(judging.READERS, "load_result", lambda folder: bytes(2 * 10**9))
    assert "MemoryError" in judging.ending(["load_result", "run"]).why


def test_codes_that_are_not_documented_are_told(tmp_path: object) -> None:
    """A command that ends well, one that is refused, and an option that is none."""
    assert judging.ending(["params", "duration"]) == judging.Ending(["params", "duration"], 0, "")
    assert judging.ending(["params", "--no"]).code == 2
