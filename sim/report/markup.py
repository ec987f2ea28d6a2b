"""Content of the sections for the template of the report (report.html.j2): texts, which it escapes, and tables of
cells."""

import collections
import pathlib

import jinja2
import markupsafe

Cell = collections.namedtuple('Cell', 'content names')
Table = collections.namedtuple('Table', 'headings rows')


def cell(content, text=False, style=''):
    """A cell of a table; text: left-aligned; style: yes, no, note, or key for what is not broken into lines."""
    return Cell(content, ' '.join(filter(None, ('text' if text else '', style))))


def table(headings, rows):
    """Headings that begin with '<' are for left-aligned columns."""
    return Table(headings, rows)


def link(name, words):
    """A link to a name on the page."""
    return markupsafe.Markup('<a href="#{}">{}</a>').format(anchor(name), words)


def fixed(value, digits=2, sign=False):
    """A number, on request with its sign, without a minus before a zero."""
    rounded = round(value, digits) or 0.0
    return f'{rounded:{"+" if sign and rounded else ""}.{digits}f}'


def seconds(value):
    return '–' if value is None else f'{value:.2f}'


def anchor(name):
    return name.replace(' ', '_')


def rendered(**content):
    """The page as HTML."""
    loader = jinja2.FileSystemLoader(str(pathlib.Path(__file__).resolve().parent))
    environment = jinja2.Environment(loader=loader, autoescape=True, trim_blocks=True, lstrip_blocks=True,
                                     undefined=jinja2.StrictUndefined)
    environment.filters['anchor'] = anchor
    return environment.get_template('report.html.j2').render(content)
