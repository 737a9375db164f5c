import jinja2
import pytest

from diff_encoder_sim.analysis.html_templates import load_template


def test_data_is_escaped_and_files_of_all_folders_are_included(tmp_path):
    for folder in ('one', 'other'):
        (tmp_path / folder).mkdir()
    (tmp_path / 'one' / 'page.html').write_text("{% include 'part.css' %}{{ name }}")
    (tmp_path / 'other' / 'part.css').write_text('p {} ')
    template = load_template('page.html', tmp_path / 'one', tmp_path / 'other')
    assert template.render(name='<b>') == 'p {} &lt;b&gt;'


def test_an_unknown_name_is_refused(tmp_path):
    (tmp_path / 'page.html').write_text('{{ nme }}')
    with pytest.raises(jinja2.UndefinedError, match='nme'):
        load_template('page.html', tmp_path).render(name='')
