"""Durable jobs, which survive crashes: jobs, the state of each, and where they are stored.

Read `jobs` (what is asked of them; `admission`: what is accepted), `runner` (how one is done) and `results` (what was found). Then read `job_records`
(what is known of one job), `job_index` (of all) and `events` (what their listeners hear). `engine` is the door to the library that goes on after a
kill, `database` what is looked at before it begins, `database_copies` what backups copy of it. `store` is where bytes are, `lru_cache` what is still in memory. `health` says whether all of
that works.
"""
