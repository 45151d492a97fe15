"""creepkit.jobs"""
