"""Surrogates: networks trained on a data set of simulations, which predict as the specimen itself would.

A recipe says how a data set becomes samples and a network; `train` fits the network in torch; the surrogate that comes
out is a records.Predictor, evaluated in NumPy, and one file.
"""
