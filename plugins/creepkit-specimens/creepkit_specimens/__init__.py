"""Test pieces for creepkit: beams in bending, tubes and plates under pressure, notched bars."""
