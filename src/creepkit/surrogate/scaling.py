"""Standardisation: to mean zero and standard deviation one over the training rows; a constant becomes zero."""

from __future__ import annotations

import torch
from torch import Tensor, nn

CONSTANT_TOLERANCE = 1e-6
"""A standard deviation below this share of the largest value is rounding: the column is constant."""


class Standardisation(nn.Module):
    """Standardises the last axis; its mean and deviation are buffers, float64, saved with the weights.

    A column that is constant in training is only shifted: the network sees zero, and the domain guard sees others.
    """

    mean: Tensor
    deviation: Tensor

    def __init__(self, mean: Tensor, deviation: Tensor) -> None:
        super().__init__()
        self.register_buffer("mean", mean.double())
        self.register_buffer("deviation", deviation.double())

    @classmethod
    def from_rows(cls, values: Tensor, mask: Tensor | None = None) -> Standardisation:
        """The scale of columns; values : (..., columns), mask : (...) which rows count. NaN counts nowhere."""
        rows = (values[mask] if mask is not None else values.reshape(-1, values.shape[-1])).double()
        mean = torch.nan_to_num(rows.nanmean(dim=0), nan=0.0)
        deviation = torch.nan_to_num((rows - mean).square().nanmean(dim=0).sqrt(), nan=0.0)
        constant = deviation <= CONSTANT_TOLERANCE * torch.nan_to_num(rows, nan=0.0).abs().amax(dim=0)
        return cls(mean, torch.where(constant, 1.0, deviation))

    @classmethod
    def identity(cls, columns: int) -> Standardisation:
        """A scale that changes nothing."""
        return cls(torch.zeros(columns), torch.ones(columns))

    def forward(self, values: Tensor) -> Tensor:
        """Standardised values."""
        return (values - self.mean.to(values.dtype)) / self.deviation.to(values.dtype)

    def inverse(self, values: Tensor) -> Tensor:
        """Physical values of standardised ones."""
        return values * self.deviation.to(values.dtype) + self.mean.to(values.dtype)
