"""Worker processes of a Ray cluster (extra ``ray``); see :func:`.session.ray_backend`.

Nothing here is imported before a user asks for Ray. The modules, from the outside inwards: session
(start or join a cluster), greeting (check that a cluster answers), worker_backend (the interface
for the rest of er-gym), actor_pool (assigns jobs to actors, and repeats lost ones), env_worker
(environments of agents in the driver), actors (the remote classes), origin (checks that worker and
driver match), warm_queue (jobs by affinity key).
"""
