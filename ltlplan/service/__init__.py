"""The planning service: missions in over HTTP, jobs that survive, a page to write, watch and trust them; `ltlplan serve` starts it.

Read `server` (what is put together and how it starts and stops), `settings` (every limit) and `data_folder`, then the rooms:
`job_queue` (what was accepted is finished), `execution` (where it is computed: never in the serving process), `api` (routes),
`event_inbox` (what flights in the air are told), `security` (who may ask, how much and how often), `page` (what a browser shows) and `views`
(pictures and sentences for it). Between them stand `queries` (what is answered at once; `query_pool`: where), `problems` (errors over
HTTP and back), `models` (what is sent) and `service` (what the routes and the page share); `client` with `client_parts` speaks to all that
under the library's names.
`log` is what the service notes, `provenance` what results depend on, and `recordings` reads recordings as they were sent. `drafts` keeps what is written, and `database_url` the
database's address.
`computing` is an earlier place of `execution`.
"""
