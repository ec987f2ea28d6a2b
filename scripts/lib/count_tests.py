"""Counts the test cases in JUnit files: "PASSED FAILED" on stdout, what failed on stderr. Argument: their directory.

rostest writes a file of its own (rostest-*) with one case per test; it counts only for what no file of that test explains: a crash."""

import pathlib
import sys
import xml.etree.ElementTree

passed, failed = 0, {}
for path in sorted(pathlib.Path(sys.argv[1]).glob('*/*.xml'), key=lambda path: path.name.startswith('rostest-')):
    try:
        cases = list(xml.etree.ElementTree.parse(path).getroot().iter('testcase'))
    except xml.etree.ElementTree.ParseError as error:
        failed.setdefault(path.stem, []).append(f'no result: {error}')
        continue
    for case in cases:
        wrong = [item for item in case if item.tag in ('failure', 'error')]
        of = f'rosunit-{case.get("name")[4:]}' if path.name.startswith('rostest-') else path.stem
        if wrong and (of == path.stem or of not in failed):
            text = ' '.join(f'{item.get("message") or ""} {item.text or ""}' for item in wrong)
            failed.setdefault(of, []).append(f'{case.get("classname")}.{case.get("name")}: {" ".join(text.split())[:600]}')
        passed += not wrong and of == path.stem and case.get('status') != 'notrun' and case.find('skipped') is None
for name, cases in failed.items():
    print(*(f'FAIL {name}: {case}' for case in cases), sep='\n', file=sys.stderr)
print(passed, sum(map(len, failed.values())))
