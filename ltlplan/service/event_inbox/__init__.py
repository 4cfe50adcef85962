"""Events that operators tell flights through the service: `flights` has the rules, `event_store` is where all of it is kept.

`names` says what flights that listen may be called, `control` who tells one events.
"""
