"""Execution of missions: never in the serving process, within limits of time and memory.

Read `stages` (what is done with a mission, one after the other), `workers` (processes that do it) on `worker_process`, `worker_main` and `forkserver_preload`
(how they are begun, what they do, how they end), `turns` (whose work comes next), `resource_limits` (what they may take), `stop_requests` (which end a search early) and `scratch` (their files); `clusters` with
`cluster_tasks` are other machines, `batches` folders of missions without a server, `serialization` what travels between processes bit for bit,
`derived` what is made of flights
(campaigns, rehearsals, recordings that are kept), `exporting` exports.
`background_executor` computes beside a flight.
"""
