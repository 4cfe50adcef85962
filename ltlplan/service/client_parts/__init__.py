"""Parts of the client: `transport` (requests to a service), `job_handle` (a job from afar) and `words` (as they travel).

`long_polling` listens for an operator's events. `exported` fetches exports.
"""
