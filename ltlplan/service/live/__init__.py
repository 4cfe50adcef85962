"""Events that operators tell flights through the service: `flights` has the rules, `book` is where all of it is kept."""
