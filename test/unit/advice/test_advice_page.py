from advised_robots import straight_advice, whole_advice
from diff_encoder_sim.advice.advice_page import write_page


def page_of(advice, folder):
    write_page(advice, folder / 'advice.html')
    return (folder / 'advice.html').read_text(encoding='utf-8')


def test_the_page_has_answers_charts_and_tables(tmp_path):
    page = page_of(whole_advice(), tmp_path)
    assert '<title>Which encoder for alto?</title>' in page
    assert '<dt>true pose at the goal</dt><dd>from 40 counts per revolution on; 28 are not enough</dd>' in page
    assert 'id="chart-share"' in page and 'id="chart-budget"' in page
    assert 'Encoders on these wheels' in page and '34 closed-loop trials' in page
    assert len(page) < 3_000_000


def test_it_loads_nothing_from_elsewhere(tmp_path):
    page = page_of(straight_advice(), tmp_path).replace('http://www.w3.org/', '')
    assert 'src="http' not in page and 'href="http' not in page
