"""Event sources of a team in flight: lines of text, wherever they come from.

| module | what it holds |
|---|---|
| `lines` | how an event is written in a line, and what comes of lines |
| `files` | lines of a file that grows, of a named pipe, or from the keyboard |
| `topics` | messages of a ROS 2 topic, a line each |

What a planning service is told comes by `ltlplan.service.client_parts.long_polling`. Each source is called fifty times a second and answers at once.
"""
