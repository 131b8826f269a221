"""Worker processes of a Ray cluster (extra ``ray``); see :func:`.session.ray_backend`.

Nothing here is imported before a user asks for Ray. The modules, from the outside inwards: session
(start or join a cluster), greeting (is one there), worker_backend (what the rest of er-gym sees),
actor_pool (jobs: who does what, what is lost with a worker), env_worker (environments of agents in
the driver), actors (what runs remotely), origin (what a worker must have in common with the
driver), warm_queue.
"""
