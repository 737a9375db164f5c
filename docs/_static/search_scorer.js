// Order of Sphinx's search results (html_search_scorer): guides, reference, API, decisions and changes.
const AFTER_GUIDES = [
  /^(architecture|benchmarks|commands|file_formats|nodes)$/,
  /^(api|notebooks)\b/,
  /^(adr|changelog|contributing)\b/,
];
var Scorer = {
  score: ([page, , , , score]) => score - 100 * AFTER_GUIDES.findIndex((pages) => pages.test(page)),
  // Sphinx's defaults:
  objNameMatch: 11,
  objPartialMatch: 6,
  objPrio: {0: 15, 1: 5, 2: -5},
  objPrioDefault: 0,
  title: 15,
  partialTitle: 7,
  term: 5,
  partialTerm: 2,
};
