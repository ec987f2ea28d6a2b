"""Writes the types of the package jackal_aic for editors, from the signatures of its docstrings. Usage: stub.py FILE.pyi ..."""

import inspect
import re
import sys

import jackal_aic

NAMES = {name: getattr(jackal_aic, name) for name in jackal_aic.__all__}
HEAD = '''"""Types for editors; help(jackal_aic.simulate) and the like say what everything means."""
from typing import *
import numpy
import jackal_aic
'''


def plain(annotation):
    return re.sub(r'numpy\.ndarray\[(?:[^\[\]]|\[[^\[\]]*\])*\]', 'numpy.ndarray', annotation).replace('jackal_aic._core.', '')


def arguments(text):
    """`a: int, b: float = 1.0` with types of Python alone and `...` as defaults."""
    parts, depth = [''], 0
    for c in text:
        depth += (c in '([{<') - (c in ')]}>')
        if c == ',' and depth == 0:
            parts.append('')
        else:
            parts[-1] += c
    found = []
    for part in parts:
        name, _, rest = part.strip().partition(': ')
        annotation, default, _ = rest.partition(' = ')
        found.append(name if name == 'self' or not rest else name + ': ' + plain(annotation) + (' = ...' if default else ''))
    return ', '.join(found)


def function(name, item):
    compiled = re.match(r'\w+\((.*)\) -> (.*)', (item.__doc__ or '').split('\n')[0])
    signature = '({}) -> {}'.format(arguments(compiled.group(1)), plain(compiled.group(2))) if compiled else str(inspect.signature(item))
    return 'def {}{}: ...'.format(name, signature)


def member(name, item):
    if isinstance(item, property):
        returned = re.search(r' -> (.*)', item.fget.__doc__ or '')
        return '{}: {}'.format(name, plain(returned.group(1)) if returned else 'Any')
    return function(name, item) if callable(item) else '{}: {}'.format(name, 'Any' if item is None else type(item).__name__)


def lines(name, item):
    if isinstance(item, tuple):
        return [name + ': Tuple[str, ...]']
    if not inspect.isclass(item):
        return [function(name, item)]
    if issubclass(item, tuple):
        return ['class {}(NamedTuple):'.format(name)] + ['    {}: {}{}'.format(
            field, inspect.formatannotation(item.__annotations__[field]), ' = ...' if field in item._field_defaults else '') for field in item._fields
        ] + ['    {}: bool'.format(key) for key, value in vars(item).items() if isinstance(value, property)]
    members = [member(key, value) for key, value in vars(item).items() if not key.startswith('_') or key in ('__init__', '__getitem__')]
    if item is jackal_aic.Drive:  # its columns
        members.append('def __getattr__(self, name: str) -> numpy.ndarray: ...')
    return ['class {}({}):'.format(name, ', '.join(base.__name__ for base in item.__bases__ if base.__name__ in NAMES))] + [
        '    ' + line for line in members or ['...']]


for path in sys.argv[1:]:
    with open(path, 'w') as stub:
        text = '\n'.join(line for name, item in NAMES.items() for line in lines(name, item))
        stub.write(HEAD + text.replace('jackal_aic.identification.', '') + '\n')
