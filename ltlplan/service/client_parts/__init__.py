"""What the client is made of: `transport` (how a service is asked), `job_handle` (a job from afar) and `words` (as they travel).

`long_polling` listens for an operator's events. `exported` fetches exports.
"""
