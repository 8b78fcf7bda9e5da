"""One counter for sinstruments, on TCP and on a pseudo-terminal: `python sinstruments_counter.py PORT LINK`."""

import sys

from sinstruments.simulator import BaseDevice, Server


class Counter(BaseDevice):
    """A register on a line."""

    x = -123.45

    def handle_message(self, message):
        """Return the reply to a line."""
        if message.strip() == b"COUN:X?":
            return b"%.2f\n" % self.x
        return None


def main():
    port, link = sys.argv[1:]
    transports = [{"type": "tcp", "url": f"127.0.0.1:{port}"}, {"type": "serial", "url": link}]
    counter = {"name": "counter", "class": "Counter", "package": __name__, "transports": transports}
    Server([counter]).serve_forever()


if __name__ == "__main__":
    main()
