"""The candidate of a rollout beside the setting in force: missions that were answered already are run once more, when nothing else waits."""

from stillroom.service.fleet.rerunning import rerun
from stillroom.service.fleet.variants import variant_of
from stillroom.store import rollouts
from stillroom.store.database import Database
from stillroom.store.grids import GridStore
from stillroom.store.rollouts import Beside


def run_next_beside(database: Database, grids: GridStore) -> bool:
    """Whether there was one to run. Nobody's map is touched."""
    with database.look() as tx:
        if not rollouts.is_any_to_run(tx):
            return False
    with database.write(durable=False) as tx:
        job = rollouts.next_to_run(tx)
    if job is None:
        return False
    variant = variant_of(job.rollout)
    if variant is None:
        with database.write(durable=False) as tx:
            rollouts.forget_to_run(tx, job.rollout.id)
        return False
    found = rerun(database, grids, job.mission_id, variant.resolvers, variant.params)
    with database.write(durable=False) as tx:
        rollouts.keep(tx, job.rollout.id, job.mission_id, Beside(found.outcome, *found.rows, found.ms, found.error))
    return True
