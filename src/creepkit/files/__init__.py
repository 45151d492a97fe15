"""creepkit.files"""
