"""Worker processes of a Ray cluster (extra ``ray``); see :func:`.session.ray_machines`.

Nothing here is imported before a user asks for Ray. The modules, from the outside inwards: session
(start or join a cluster), greeting (check that a cluster answers), machines (the interface for the
rest of er-gym), crew (assigns jobs to actors, and repeats lost ones), env_worker (environments of
agents in the driver), actors (the remote classes), origin (checks that worker and driver match),
warm_queue (jobs by room).
"""
