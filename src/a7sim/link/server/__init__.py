"""Server side of a link: endpoints, client sessions, pacing and faults."""
