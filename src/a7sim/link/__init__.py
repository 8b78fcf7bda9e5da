"""The link: the command language over serial lines, in process, TCP, pty and RFC 2217."""
