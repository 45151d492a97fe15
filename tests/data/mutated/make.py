"""Write the small files that are mutated and take long to make: `python tests/data/mutated/make.py`.

Of the class of formats that tests/data/formats lacks; tests/benchmarks/file_samples/kept.py reads them.
"""

import sys
from pathlib import Path

FOLDER = Path(__file__).resolve().parent
sys.path.insert(0, str(FOLDER.parents[1]))

import creepkit as ck  # noqa: E402
from creepkit.surrogates.parameter_gru import ParameterGru, Training  # noqa: E402
from creepkit.surrogates.training import train  # noqa: E402
from helpers.planted_datasets import bars  # noqa: E402
from helpers.planted_rupture import larson_miller, planted  # noqa: E402


def main() -> None:
    for path in (*FOLDER.glob("*.json"), *FOLDER.glob("*.safetensors")):
        path.unlink()
    tests = planted(larson_miller, count=14, heats=2, end=3000.0)
    ck.rupture(tests, temperatures=[873.15], settings=ck.RuptureSettings(degrees=(1,))).save(FOLDER / "rupture.json")
    recipe = ParameterGru(4, 1, target="log", training=Training(epochs=1, batch=32, rate=1e-2))
    train(bars(40), recipe).save(FOLDER / "surrogate.safetensors")


if __name__ == "__main__":
    main()
