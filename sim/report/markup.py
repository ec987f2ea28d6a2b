"""Pieces of HTML that the sections of the report share."""

import html

STYLE = '''
body { font: 15px/1.45 sans-serif; max-width: 1100px; margin: 2em auto; padding: 0 1em; color: #222; }
table { border-collapse: collapse; margin: .6em 0 1.2em; }
th, td { border-bottom: 1px solid #ccc; padding: .2em .7em; text-align: right; }
th { background: #f2f2f2; } td.text, th.text { text-align: left; }
.yes { color: #00704d; } .no { color: #b03a00; } .note { color: #555; }
img { max-width: 100%; } .wide { overflow-x: auto; } .wide table { font-size: 12.5px; }
.wide th, .wide td { padding: .2em .45em; } .wide td.text { white-space: nowrap; } th.group { text-align: center; border-left: 2px solid #fff; } h2 { margin-top: 2em; border-top: 2px solid #ddd; padding-top: .6em; }
'''

escape = html.escape


def cell(content, text=False, style=''):
    names = ' '.join(filter(None, ('text' if text else '', style)))
    return f'<td class="{names}">{content}</td>' if names else f'<td>{content}</td>'


def table(headings, rows, groups=()):
    """Headings that begin with '<' are for left-aligned columns. groups: (heading, columns it spans) above them."""
    over = ''.join(f'<th class="group" colspan="{span}">{escape(heading)}</th>' for heading, span in groups)
    over = f'<tr>{over}</tr>' if over else ''
    head = ''.join(f'<th class="text">{escape(h[1:])}</th>' if h.startswith('<') else f'<th>{escape(h)}</th>'
                   for h in headings)
    return f'<table>{over}<tr>{head}</tr>' + ''.join(f'<tr>{"".join(row)}</tr>' for row in rows) + '</table>'


def seconds(value):
    return '–' if value is None else f'{value:.2f}'


def number(value):
    return '–' if value is None else f'{value:g}'


def anchor(name):
    return escape(name.replace(' ', '_'))
