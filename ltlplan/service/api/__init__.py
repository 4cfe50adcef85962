"""The HTTP API: thin routes over jobs and questions; `/docs` is made of what stands here.

Read `application` (everything put on one app), then the routes by subject: `missions`, `jobs`, `flights` (words and recorded flights),
`about` (health, documentation, login). `request_parsing` takes requests apart, `answers` holds the values that only HTTP knows, `schema` says all
of it as OpenAPI.
`events` streams a job's events; `live` receives what operators send to flights, `live_view` shows flights in the air and orders them to stop. `login` and
`people` are for accounts, `stored` for missions with their versions, `drafts` for those that are being written, `studies` for many jobs of one mission, `derived` for what is made of a job's flight, and `route_actions` says
which action each route asks for.
"""
