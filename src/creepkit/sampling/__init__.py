"""creepkit.sampling"""
