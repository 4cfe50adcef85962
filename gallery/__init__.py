"""Gallery of missions: each a question, the command that answers it, and the page that it makes.

`python -m gallery` builds all pages into `out/gallery`, which the documentation's site takes up, and lists what changed against
`results.json`: words, costs, durations, verdicts. `--only 03 17` builds some; `--accept` writes what was found down as the new results.
Read `entries` (what is shown), `building` (how it is run and compared), then `pages`. `shows` makes a show of others, `picture` the README's picture.
"""
