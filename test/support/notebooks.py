"""Runs the code of a notebook as Jupyter does, cell by cell, with what it prints and draws, and no library for that."""

import json
import subprocess
import sys

# Reads the cells, runs them in one namespace; prints what each printed, and the chart it ends with as PNG in base64.
RUN = """
import ast, base64, contextlib, io, json, sys
import altair
import vl_convert

def run(source, namespace):
    *body, last = ast.parse(source).body
    exec(compile(ast.Module(body, []), 'cell', 'exec'), namespace)
    if isinstance(last, ast.Expr):
        return eval(compile(ast.Expression(last.value), 'cell', 'eval'), namespace)
    exec(compile(ast.Module([last], []), 'cell', 'exec'), namespace)

namespace, done = {'__name__': '__main__'}, []
version = '.'.join(altair.SCHEMA_VERSION.lstrip('v').split('.')[:2])
for source in json.load(sys.stdin):
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        chart = run(source, namespace)
    drawn = [vl_convert.vegalite_to_png(chart.to_dict(), vl_version=version)] if hasattr(chart, 'to_dict') else []
    done.append([printed.getvalue(), [base64.b64encode(picture).decode() for picture in drawn]])
print(json.dumps(done))
"""


def code_cells(notebook):
    return [cell for cell in notebook['cells'] if cell['cell_type'] == 'code']


def run(notebook, folder, environment):
    """Run a notebook in a folder: for each code cell, the text that it prints, and its figures."""
    sources = json.dumps([''.join(cell['source']) for cell in code_cells(notebook)])
    done = subprocess.run(
        [sys.executable, '-c', RUN], input=sources, env=environment, cwd=str(folder), capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


def shown(cell):
    """The text and the figures that a notebook shows below a cell."""
    text = ''.join(''.join(output['text']) for output in cell['outputs'] if output['output_type'] == 'stream')
    return text, [output['data']['image/png'] for output in cell['outputs'] if output['output_type'] == 'display_data']


def show(notebook, done):
    """Put what was printed and drawn below the cells."""
    for count, (cell, (text, pictures)) in enumerate(zip(code_cells(notebook), done), 1):
        cell['execution_count'] = count
        stream = {'name': 'stdout', 'output_type': 'stream', 'text': text.splitlines(keepends=True)}
        cell['outputs'] = [stream] if text else []
        for picture in pictures:
            data = {'image/png': picture, 'text/plain': ['alt.Chart(...)']}
            cell['outputs'].append({'data': data, 'metadata': {}, 'output_type': 'display_data'})
