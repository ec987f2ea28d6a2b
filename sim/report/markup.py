"""Content of the page for its template (report.html.j2): tables of rows, numbers and links."""

import pathlib
import re

import jinja2
import markupsafe

NUMBER = re.compile(r'(|[–-]|nan|unstable|[+-]?\d.*(?<! Hz))')  # cells of a column that is right-aligned
STYLES = {'met': 'yes', 'agrees': 'yes', 'same': 'yes', 'missed': 'no', 'differs': 'no', 'unstable': 'no'}


def columns(rows):
    """Headings of a table, which is a list of dicts, and the class of each: text is left-aligned."""
    return {name: '' if all(re.fullmatch(NUMBER, str(row[name])) for row in rows) else 'text' for name in rows[0]}


def link(name, words):
    """A link to a name on the page."""
    return markupsafe.Markup('<a href="#{}">{}</a>').format(anchor(name), words)


def fixed(value, digits=2, sign=False):
    """A number, on request with its sign, without a minus before a zero; a dash for None."""
    if value is None:
        return '–'
    rounded = round(value, digits) or 0.0
    return f'{rounded:{"+" if sign and rounded else ""}.{digits}f}'


def anchor(name):
    return name.replace(' ', '_')


def rendered(**content):
    """The page as HTML."""
    loader = jinja2.FileSystemLoader(str(pathlib.Path(__file__).resolve().parent))
    environment = jinja2.Environment(loader=loader, autoescape=True, trim_blocks=True, lstrip_blocks=True,
                                     undefined=jinja2.StrictUndefined)
    environment.filters.update(anchor=anchor, columns=columns)
    environment.globals.update(styles=STYLES)
    return environment.get_template('report.html.j2').render(content)
