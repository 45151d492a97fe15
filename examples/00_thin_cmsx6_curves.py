r"""Thin measured creep curves
==========================

How the creep curves of CMSX-6 that ship with this package were made from the measured ones.

Of some thousand frames a curve, sixty are kept: the first and the last, twenty equally spaced in the logarithm of
time, which follow primary creep, and the others equally spaced along the curve, each axis divided by its last value,
which follow it to rupture. No number is smoothed or corrected. The folder that is read holds an ``index.csv`` with
one line a test, and a file of frames for each test::

    python examples/00_thin_cmsx6_curves.py FOLDER [OUT]
"""

import sys
from pathlib import Path

import numpy as np

import creepkit as ck

FRAMES, EARLY_FRAMES = 60, 20

paths = [Path(word) for word in sys.argv[1:] if word != "--quick"]
folder = paths[0] if paths else ck.example_data("cmsx6")
out = paths[1] if len(paths) > 1 else Path("cmsx6_thinned")

# %%
# Which frames are kept
# ---------------------


def kept_frames(times: np.ndarray, strain: np.ndarray) -> np.ndarray:
    """Indices of the frames that are kept, ascending; times : (frames,) s; strain : (frames,)."""
    path = np.hypot(np.diff(times / times[-1]), np.diff(strain / strain[-1]))
    length = np.concatenate([[0.0], np.cumsum(path)])
    early = np.searchsorted(times, np.geomspace(60.0, times[-1], EARLY_FRAMES))
    count = FRAMES - EARLY_FRAMES
    while True:  # some frames are chosen twice; ask for more until there are enough
        along = np.searchsorted(length, np.linspace(0.0, length[-1], count))
        kept = np.unique(np.concatenate([[0], early, along, [times.size - 1]]).clip(max=times.size - 1))
        if kept.size >= min(FRAMES, times.size):
            return kept
        count += 1


# %%
# One file a test
# ---------------
# Conditions, rupture times and loading strains are kept as they were read.

out.mkdir(parents=True, exist_ok=True)
for test in ck.read_histories(folder):
    kept = kept_frames(test.times, test.outputs["strain"])
    thinned = test.replace(
        times=test.times[kept],
        outputs={"strain": np.round(test.outputs["strain"][kept], 9)},
        used=test.used[kept],
        rupture_time=test.rupture_time,
        unruptured=test.unruptured,
        alloy="CMSX-6",
        source="",
    )
    with ck.overwriting():  # files that version control put there
        ck.write_history(thinned, out / f"{test.name}.csv")
    end = f"ruptured at {test.rupture_time / 3600:.1f} h" if test.rupture_time else "stopped"
    print(f"{test.name}: {test.times.size} frames to {test.times[-1] / 3600:.0f} h ({end}), {kept.size} kept")
