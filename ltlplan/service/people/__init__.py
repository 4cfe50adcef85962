"""People of a service: accounts and roles, the owners of jobs, and the log of what each user did.

Read `people` and `roles`, then `accounts` (`passwords`, `openid`), `sessions`, `job_references` and `user_jobs`; `administration` changes people, and
`audit_log` lists what was done. `stored_missions` are theirs, with all versions, and `studies` of jobs, which `user_studies` makes; `webhooks` hear of the ends
of jobs. All of it is in one file, `DATA/people.sqlite` (`database`).

One function, `roles.require(principal, action)`, decides what somebody may do. Pages and routes reach jobs through `user_jobs.UserJobs` alone, which
asks it. The design is in docs/service.md.
"""
