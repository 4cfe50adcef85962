"""Parts of the client: `transport` (requests to a service), `flights_client` (an operator's half of it), `job_handle` (a job from afar)
and `words` (as they travel).

`people_client` is a lab's half, `stored_client` a writer's, `studies_client` an experimenter's over `missions_client`, `derived_client` a tester's. `long_polling` listens for an
operator's events, `flight_feed` shows a flight in the air and hears orders to stop, by a process of its own (`feed_process`,
spoken to by `feed_pipe`). `exported` fetches exports.
"""
