"""Events that operators tell flights through the service: `flights` has the rules, `event_store` is where all of it is kept."""
