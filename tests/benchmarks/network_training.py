"""Training and prediction of networks: seconds an epoch, evaluation, prediction, and validation loss by batch and rate.

    python tests/benchmarks/network_training.py [--parts speed prediction losses] [--device auto]
                  [--networks 128x3 512x5] [--batches 64 256 1024 2048] [--precisions float32 bf16] [--samples 21000]
                  [--interval 900] [--every 4] [--epochs 50] [--variants BATCH:RATE:SEED ...] [--folder build/networks]
                  [--write]

The data set is 20,000 samples of the combined law on the dimple, of 12 h, generated where `--folder` has none. Speed:
one epoch with its validation, after one that warms up, of as many samples as `--samples` says (2000 of the data set,
repeated; a fifth of them is for validation); bf16 is torch's autocast. float32 on a GPU is what torch does by itself:
TF32 inside cuDNN's recurrent layers. Evaluation: the validation rows after a training, by torch on the device of the
training, and by NumPy in double precision on one core. Prediction: 300 candidates in one test by NumPy, in double and
in single precision, and the largest difference between these as a share of the largest output. Losses: Eq. (4) of the
validation rows, of the first network, with one frame in `--every`, for a batch and a rate at the beginning; one
training each, so that a few per cent between two of them say nothing.
"""

import time
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

import numpy as np
import torch
from measured import Page, arguments, progress

import creepkit as ck
from creepkit.sampling.conditions import TimeGrid
from creepkit.surrogates.evaluation import training_split
from creepkit.surrogates.parameter_gru import ParameterGru, Training
from creepkit.surrogates.parameter_network import sample_tensors, weights_of
from creepkit.surrogates.surrogate import Surrogate, load_surrogate
from creepkit.surrogates.training import NetworkTraining, train

ON_A_GPU = (
    ("128x3", 64, "0.91", "0.97", "1.30"),
    ("128x3", 256, "0.53", "0.50", "0.39"),
    ("128x3", 1024, "0.52", "0.48", "0.22"),
    ("512x5", 64, "17.3", "16.1", "17.0"),
    ("512x5", 256, "7.1", "3.8", "4.2"),
    ("512x5", 1024, "5.0", "1.8", "1.3"),
    ("512x5", 2048, "4.9", "1.9", "1.2"),
)
"""Seconds of an epoch by torch alone, measured on 2026-11-27 on an H100; not by this program."""


BATCHES = (64, 256, 1024, 2048)
CANDIDATES = 300
CPU = torch.device("cpu")
PARTS = ("speed", "prediction", "losses")


def data_set(folder, interval):
    """The accepted samples, with frames `interval` s apart."""
    file = folder / f"combined-{interval:g}.h5"
    if not file.exists():
        ck.generate("combined", "bulge", 20_000, seed=1, to=file, every=interval)
    return ck.read_dataset(file, accepted_only=True)


def thinned(data, every):
    """The same samples with one frame of `every`."""
    return replace(data, grid=TimeGrid(data.grid.values[::every]), values=data.values[:, ::every].copy())


def seconds(call, device=CPU):
    """CPU time, s; on a GPU wall time until it has finished."""
    clock = time.process_time if device.type == "cpu" else time.perf_counter
    start = clock()
    call()
    if device.type == "cuda":
        torch.cuda.synchronize()
    return clock() - start


def fresh_fit(data, samples, count, recipe, device):
    """A network before its first epoch, on as many samples as `count`: those of the data, repeated."""
    repeated = {name: array[np.resize(np.arange(len(data)), count)] for name, array in samples.items()}
    rows = training_split(count, recipe.training, 0)
    torch.manual_seed(0)
    module = recipe.module(data, sample_tensors(samples), torch.arange(len(data)))
    return NetworkTraining(module, repeated, rows, recipe.training, 0, device)


def untrained(data, samples, recipe):
    """A network as it begins, in the place of a trained one, which takes as long."""
    tensors, rows = sample_tensors(samples), torch.arange(len(data))
    module = recipe.module(data, tensors, rows)
    return Surrogate(recipe, weights_of(module.state_dict()), recipe.metadata(data, tensors, rows, module))


def speed(page, data, samples, options, device):
    """Seconds of an epoch, and of the evaluation after a training."""
    where = "the processor, CPU time" if device.type == "cpu" else f"{torch.cuda.get_device_name()}, wall time"
    page.heading(f"Speed on {where}")
    page.paragraph(f"{options.samples} samples of {data.grid.frames} frames, {torch.get_num_threads()} threads.")
    page.table("network", "batch", "precision", "epoch, s", "evaluation, s", "by NumPy, CPU s")
    for network in options.networks:
        hidden, layers = map(int, network.split("x"))
        by_numpy = numpy_evaluation(data, samples, ParameterGru(hidden, layers), options.samples // 5)
        for batch in options.batches:
            recipe = ParameterGru(hidden, layers, training=Training(batch=batch))
            for precision in options.precisions:
                fit = fresh_fit(data, samples, options.samples, recipe, device)
                half = torch.autocast(device.type, torch.bfloat16) if precision == "bf16" else nullcontext()
                with half:
                    fit.epoch()
                    times = seconds(fit.epoch, device), seconds(fit.best_outputs, device), by_numpy
                page.row(network, batch, precision, *(f"{t:.2f}" for t in times))


def of_another_day(page):
    """What torch alone took on a GPU, where this run has none."""
    page.heading("On a GPU, of another day")
    page.paragraph(
        "Not measured in this run, nor with creepkit: the same layers in torch 2.11 alone (cuDNN, fused Adam, 16,800 "
        "histories of 289 frames on the device) on one NVIDIA H100 on 2026-11-27, s an epoch. What `creepkit surrogate "
        "train` takes on a GPU since its evaluation moved there has not been measured yet."
    )
    page.table("network", "batch", "float32 without TF32", "TF32", "bf16")
    for cells in ON_A_GPU:
        page.row(*cells)


def numpy_evaluation(data, samples, recipe, count):
    """Seconds of the evaluation of so many rows by NumPy in double precision, from a few hundred of them."""
    model, few = untrained(data, samples, recipe), min(count, 256)
    return seconds(lambda: model.predict_samples({name: v[:few] for name, v in samples.items()})) * count / few


def prediction(page, data, samples, options):
    """CPU seconds of candidates in one test, in double and single precision."""
    page.heading(f"Prediction of {CANDIDATES} candidates in one test of {data.grid.frames} frames")
    page.table("network", "double, CPU s", "single, CPU s", "ratio", "largest difference")
    theta, tests = data.law.to_internal(data.parameters[:CANDIDATES]), [data.planned_test(0)]
    for network in options.networks:
        double = untrained(data, samples, ParameterGru(*map(int, network.split("x"))))
        models = double, double.for_search()
        exact, rounded = (one.predict(data.law, theta, tests).values for one in models)
        times = [
            min(seconds(lambda model=one: model.predict(data.law, theta, tests)) for _ in range(3)) for one in models
        ]
        difference = np.nanmax(np.abs(rounded - exact), axis=(0, 1, 2)) / np.nanmax(np.abs(exact), axis=(0, 1, 2))
        page.row(network, *(f"{t:.2f}" for t in times), f"{times[0] / times[1]:.1f}", f"{difference.max():.1e}")


def losses(page, data, options):
    """Eq. (4) of the validation rows by batch and rate."""
    hidden, layers = map(int, options.networks[0].split("x"))
    page.heading(f"Validation loss of {options.networks[0]} by batch and rate")
    page.paragraph(f"{len(data)} samples of {data.grid.frames} frames, a fifth of them for validation.")
    page.table(
        "batch", "rate", "seed", "epochs", "steps", "lowest Eq. (4), 1e-2", "mean of the last five", "best epoch"
    )
    for variant in options.variants:
        batch, rate, seed = [*variant.split(":"), "0"][:3]
        training = Training(epochs=options.epochs, batch=int(batch), rate=float(rate))
        file = options.folder / f"{hidden}x{layers}-{batch}-{rate}-{seed}.safetensors"
        if not file.exists():
            progress(f"trains {file}")
            train(data, ParameterGru(hidden, layers, training=training), to=file, seed=int(seed), device=options.device)
        metadata = load_surrogate(file).metadata
        known, rse = metadata.provenance, np.array(metadata.curves["rse"])
        steps = -(-known["training_rows"] // int(batch)) * known["epochs"]
        numbers = f"{100 * rse.min():.2f}", f"{100 * rse[-5:].mean():.2f}", known["best_epoch"]
        page.row(batch, rate, seed, known["epochs"], steps, *numbers)


def main():
    parser = arguments(__doc__)
    parser.add_argument("--parts", nargs="*", default=list(PARTS), choices=PARTS)
    parser.add_argument("--device", default="auto", choices=("auto", "cpu", "cuda"))
    parser.add_argument("--networks", nargs="*", default=["128x3", "512x5"])
    parser.add_argument("--batches", nargs="*", type=int, default=list(BATCHES))
    parser.add_argument("--precisions", nargs="*", default=["float32", "bf16"], choices=("float32", "bf16"))
    parser.add_argument("--samples", type=int, default=21_000)
    parser.add_argument("--interval", type=float, default=900.0, help="s between frames of the data set")
    parser.add_argument("--every", type=int, default=4)
    parser.add_argument("--epochs", type=int, default=50)
    parser.add_argument("--variants", nargs="*", default=["64:1e-3", "256:2e-3", "256:4e-3", "1024:8e-3"])
    parser.add_argument("--folder", type=Path, default=Path("build/networks"))
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    device = torch.device("cuda" if options.device != "cpu" and torch.cuda.is_available() else "cpu")
    page, data = Page("network_training", __doc__), data_set(options.folder, options.interval)
    few = data.rows(slice(0, 2000))
    samples = ParameterGru().sample_arrays(few)
    if "speed" in options.parts:
        speed(page, few, samples, options, device)
        if device.type == "cpu":
            of_another_day(page)
    if "prediction" in options.parts:
        prediction(page, few, samples, options)
    if "losses" in options.parts:
        losses(page, thinned(data, options.every), options)
    if options.write:
        page.write()


if __name__ == "__main__":
    main()
