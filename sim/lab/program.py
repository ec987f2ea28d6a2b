"""How the programs of the lab read their options and end: an error is one line, and a closed pipe or Ctrl-C is no traceback."""

import argparse
import signal
import sys


class Parser(argparse.ArgumentParser):
    """Errors are one line."""

    def error(self, message):
        command = self.prog.partition(' ')[2]
        raise ValueError('{}{}; see {} --help'.format(command and command + ': ', message, self.prog))


def run(name, main):
    """Calls main with the arguments of the command line and ends the program; ValueError, LookupError and OSError print one line."""
    signal.signal(signal.SIGPIPE, signal.SIG_DFL)  # `experiments list | head` ends without a word
    try:
        sys.exit(main(sys.argv[1:]))
    except (ValueError, LookupError, OSError) as error:
        line = ''.join(c if c.isprintable() else '\\x{:02x}'.format(ord(c)) for c in str(error))
        print('{}: {}'.format(name, line), file=sys.stderr)
        sys.exit(1)
    except KeyboardInterrupt:
        sys.exit(130)
