"""The command language over a line: in process so far, any pyserial port for the client."""
