"""Interactive charts for pages that any browser opens, offline: drawn by Vega-Lite, which the page has in it."""

from diff_encoder_sim.analysis.charts.chart import Chart, Choice, Look, Option
from diff_encoder_sim.analysis.charts.page_part import charts_html

__all__ = ['Chart', 'Choice', 'Look', 'Option', 'charts_html']
