"""A data set on SLURM through dask: pip install 'creepkit[cluster]' dask-jobqueue, then python dask_slurm.py FILE."""

import sys

from dask_jobqueue import SLURMCluster

import creepkit as ck

if __name__ == "__main__":
    jobs = SLURMCluster(
        cores=4,
        processes=4,  # one thread each: a simulation uses one
        memory="4GB",
        walltime="04:00:00",
        job_script_prologue=["export OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1"],
    )
    jobs.adapt(maximum_jobs=16)
    data = ck.generate(
        "combined",
        "bulge",
        samples=155_186,
        seed=1,
        to=sys.argv[1],
        cluster=jobs.scheduler_address,
        workers=128,  # shards that are handed over at once
        progress=lambda task, done, total, note: print(f"{task}: {done} of {total} ({note})", flush=True),
    )
    print(data)
