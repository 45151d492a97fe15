"""creepkit.report"""
