"""What the client is made of: `wire` (how a service is asked), `submitted` (a job from afar) and `words` (as they travel)."""
