"""Suspect frames are left out once, where the settings say so, and named with their tests."""

import numpy as np

import creepkit as ck
from creepkit.inverse.history_checks import suspect_frames_note, without_suspect_frames
from creepkit.records import History, constant_stress

EXCLUDE, KEEP = ck.IdentificationSettings(), ck.IdentificationSettings(suspect_frames="keep")


def clean_and_spoilt() -> list[History]:
    """A straight line with noise of 1e-5, one of whose 40 frames is 1e-3 off; and one without."""
    times, rng = np.linspace(1e3, 4e4, 40), np.random.default_rng(0)
    strain = [1e-7 * times + 1e-5 * rng.standard_normal(times.size) for _ in range(2)]
    strain[1][20] += 1e-3
    return [
        History(name, times, {"strain": s}, constant_stress(50), 1000.0) for name, s in zip("ab", strain, strict=True)
    ]


def test_the_frame_is_left_out_and_named() -> None:
    clean, spoilt = without_suspect_frames(clean_and_spoilt(), EXCLUDE)
    assert clean.used.all()
    assert np.flatnonzero(~spoilt.used).tolist() == [20]
    assert suspect_frames_note([clean, spoilt]) == ("suspect frames were left out: 1 of 40 of 'b' (outlier, frame 20)",)
    again = without_suspect_frames([clean, spoilt], EXCLUDE)
    assert [h.used.tolist() for h in again] == [clean.used.tolist(), spoilt.used.tolist()]


def test_the_settings_may_keep_it() -> None:
    tests = clean_and_spoilt()
    assert without_suspect_frames(tests, KEEP) == tests
    assert suspect_frames_note(tests) == ()
