"""Whatever a file of frames holds, reading it gives frames or a HistoryError of one sentence."""

from __future__ import annotations

import random
from pathlib import Path

import numpy as np
import pytest

import creepkit as ck
from creepkit.errors import HistoryError
from helpers.camera_samples import SAMPLES, vic_3d_images

MUTATIONS = 40
PIECES = (
    *(b"nan", b"inf", b"1e308", b"1e400", b"-1", b"0", b"1e-320", b"\xd9\xa3", b"-nan(ind)", b"1,5", b"1.5.5", b"0e99"),
    *(
        b"",
        b" ",
        b",",
        b";",
        b"\t",
        b"#",
        b'"',
        b"\n",
        b"\r",
        b"\0",
        b"\x0c",
        b"\xe2\x80\xa8",
        b"\xef\xbb\xbf",
        b"\xff\xfe",
    ),
    *(b"1" * 500, b"mm", b"[px]", b"X [mm]", b"***", b"\x80", b"\n\n"),
)
CASES = {name: (write, file) for name, (write, file, _) in SAMPLES.items()} | {"images": (vic_3d_images, "all.csv")}


def mutated(generator: random.Random, content: bytes) -> bytes:
    """The content with some pieces put in, taken out, exchanged or repeated, or cut off."""
    result = bytearray(content)
    for _ in range(generator.choice([1, 1, 2, 5])):
        place, kind = generator.randrange(len(result) + 1), generator.randrange(5)
        if kind == 0:
            result[place : place + generator.randrange(12)] = generator.choice(PIECES)
        elif kind == 1:
            del result[place : place + generator.randrange(1, 30)]
        elif kind == 2:
            del result[place:]
        elif kind == 3:
            result[place : place + 1] = bytes([generator.randrange(256)])
        else:
            start = generator.randrange(len(result) + 1)
            result[place:place] = result[start : start + generator.randrange(200)]
    return bytes(result)


@pytest.mark.parametrize("name", CASES)
def test_any_change_gives_frames_or_one_sentence(name: str, tmp_path: Path) -> None:
    write, file = CASES[name]
    content, generator = write(), random.Random(name)
    for _ in range(MUTATIONS):
        (tmp_path / file).write_bytes(mutated(generator, content))
        try:
            for frame in ck.read_frames(tmp_path / file):
                assert np.isfinite(frame.points[frame.valid]).all()
        except HistoryError as error:
            text = str(error)
            assert file in text
            assert "\n" not in text
            assert len(text) < 900
