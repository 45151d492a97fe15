"""What remembers better in RateNet: strain-weighted means, or recurrence? The choice of the package, measured.

    python tests/benchmarks/rate_net_memory.py RATES.h5 [--samples 2000] [--epochs 60] [--seeds 2]

RATES.h5 is a set of the rate family (`creepkit generate rate-family --samples 2000 --seed 1 --to RATES.h5`). The
recurrent network (a GRU of 64 with a skip, then two layers of 64) sees the inputs of each node alone, the direct one
also their means over the creep so far. Columns: weights; CPU-s with features; Eq. (4) of the validation rows: outputs
together, D_amp, S_d, S_p; largest error of a history, median and 95 %, um.
"""

import argparse
import time
from dataclasses import dataclass

import torch
from torch import nn

import creepkit as ck
from creepkit.surrogates.rate_net import RateNet
from creepkit.surrogates.rate_network import LOCAL_INPUTS, RateModule

HIDDEN = 64


class Memory(nn.Module):
    """A GRU with a skip over the inputs of each node alone, the first `own` of them."""

    def __init__(self, own, hidden):
        super().__init__()
        self.own = own
        self.entry = nn.Sequential(nn.Linear(own, hidden), nn.SiLU())
        self.memory = nn.GRU(hidden, hidden, batch_first=True)
        self.rest = nn.Sequential(nn.Linear(2 * hidden, hidden), nn.SiLU(), nn.Linear(hidden, hidden), nn.SiLU())

    def forward(self, seen):
        x = self.entry(seen[..., : self.own])
        return self.rest(torch.cat([x, self.memory(x)[0]], dim=-1))


@dataclass(frozen=True)
class RecurrentRateNet(RateNet):
    """RateNet with another module; everything else is the package's."""

    def module(self, data, samples, train):
        made = RateModule(samples["inputs"].shape[-1], HIDDEN, self.layers)
        made.layers = Memory(len(self.stress_factors) * len(self.strain_factors) + len(LOCAL_INPUTS), HIDDEN)
        return made.with_scales(samples, train)


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("data")
    options.add_argument("--samples", type=int, default=2000)
    options.add_argument("--epochs", type=int, default=60)
    options.add_argument("--seeds", type=int, default=2)
    given = options.parse_args()
    torch.set_num_threads(1)
    data = ck.read_dataset(given.data, accepted_only=True).rows(slice(0, given.samples))
    training = ck.Training(epochs=given.epochs, rate=3e-3, schedule="cosine", clip=1.0, validation=0.1)
    print("| memory | weights | seed | CPU s | together | D_amp 1e-4 | S_d 1e-4 | S_p 1e-4 | largest um | 95 % |")
    print("|" + "-|" * 10)
    for seed in range(given.seeds):
        for title, kind in (("means", RateNet), ("recurrent", RecurrentRateNet)):
            began = time.process_time()
            model = ck.train(data, kind(training=training), seed=seed)
            weights = sum(p.numel() for p in model.module.parameters())
            told = model.metadata.metrics
            outputs = " | ".join(f"{1e4 * told['outputs'][name]['rse']:.2f}" for name in data.outputs)
            largest = told["outputs"][data.outputs[0]]
            cost = time.process_time() - began
            print(
                f"| {title} | {weights} | {seed} | {cost:.0f} | {told['loss']:.2e} | {outputs} | "
                f"{1e3 * largest['largest_median']:.2f} | {1e3 * largest['largest_p95']:.1f} |", flush=True,
            )  # fmt: skip


if __name__ == "__main__":
    main()
