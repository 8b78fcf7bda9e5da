"""Client side of a link: ports, lines, replies, the recording proxy."""
