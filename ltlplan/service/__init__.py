"""Planning service: missions in over HTTP, durable jobs, and a page to write, watch and trust them; `ltlplan serve` starts it.

Read `server` (composition, start and stop), `settings` (every limit; `limits_file` reads others) and `storage` (the folder of data, and its backups). Then read the subpackages: `job_queue` (accepted jobs survive
crashes), `execution` (computation, never in the serving process), `api` (routes), `event_inbox` (operator events for flights) and `live_view` (flights as
they are seen, and orders to stop). The others are
`security` (access, rates and sizes), `people` (accounts, roles and whose a job is), `page` (the browser's page) and `views` (its pictures and
sentences). Between them stand `queries` (short requests; `query_pool` answers them), `problems` (errors over HTTP and back), `models` and
`people_models` and `study_models` (values that are sent), `figures` (of a job, for tables) and `service` (common to routes and page). `client` with `client_parts` offers all that under the library's
names. `systemd` is told that it is alive. `log` is the service's log, `metrics` counts for Prometheus. `webhook_sender` tells users' addresses of the ends of jobs. `provenance` is what results depend
on, `recordings` reads uploaded recordings, and `times` says what time it is. `computing` is an earlier place of `execution`.
"""
