"""People of a service: who they are, what each may do, whose a job is, and who did what.

Read `people` and `roles`, then `accounts` (`passwords`, `openid`), `sessions`, `job_references` and `user_jobs`; `administration` changes people, and `audit_log` lists
what was done. `stored_missions` are theirs, with all versions.

**Tables** (`DATA/people.sqlite`, one file wherever the jobs are; `database`):

    accounts(name, role, password, temporary, issuer, subject, made, disabled)   password: an Argon2id hash; issuer and subject: OpenID Connect
    sessions(digest, owner, token, began, ends)        of browsers: of an account, or of a token (then its digest)
    job_references(job, user, project, made)           a computation is shared by key, a job is somebody's reference to it
    projects(name, owner, shared, made)                a reference is private unless its project is shared
    leaving(job)                                       jobs whose last reference went, until they are deleted
    missions(id, name, owner, project, tags, made)     stored missions, and all their versions
    mission_versions(mission, number, text, user, made)
    log(number, time, user, role, action, object, detail)

Tokens stay in `DATA/tokens.json`: programs have them, and the command line changes them. A user is a name: of an account, or of a token that belongs to none.

**Authorisation** is decided by one function, `roles.require(principal, action)`. The gate makes a `Principal` of each request (`people.People`). Each route names its
action in one table (`api/route_actions.py`), which a dependency of the whole application reads; a route that is not in it is answered to nobody, and a test walks over all of
them. Pages and routes reach jobs through `user_jobs.UserJobs` alone, which asks the same function, and shows nobody what is not theirs: an invisible job is one that is not there.

**Sessions** are looked up at every message, so what ends one (log out, a new password, another role, a disabled account, a revoked token) ends its pages and streams within a second.

**Migration.** Tables are made, and later versions' steps are done, in one transaction at the first use. Sessions of 0.2.0 (`sessions.json`) are taken over. At its first start with
this version the service gives each earlier job to the user who submitted it, in the shared project `earlier`: who could see it sees it still. A job that a kill left without any
reference becomes its submitter's at the next start.

**One person on one machine** has no account and no token: whoever asks from this machine is `local`, an admin, and sees no login.
"""
