"""The planning service: missions in over HTTP, jobs that survive, a page to write, watch and trust them; `ltlplan serve` starts it.

Read `server` (what is put together and how it starts and stops), `settings` (every limit), then `jobs` and `stages` (what was accepted
is finished), `workers` (where it is computed: never in the serving process; `clusters`: on other machines, by `cluster_tasks`),
`batches` (folders of missions, without a server), `questions` (what is answered at once), `problems` (errors over HTTP and back),
`api` (routes), `security` (who may ask, how much and how often), `page` (what a browser shows) and `client`, which speaks to all that
under the library's names.
"""
