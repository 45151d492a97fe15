"""Resumable parallel work: tasks of a job, worker processes or a cluster, shard locks and the progress record."""
