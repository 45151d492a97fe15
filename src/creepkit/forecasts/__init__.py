"""Forecasts: what further tests will show by an identified law, within which band, and what the band is made of."""
