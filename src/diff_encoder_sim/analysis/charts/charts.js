'use strict';

// Draws the charts of a page from the JSON beside them, and lets its reader choose what they show.
(() => {
  const part = document.querySelector('.charts');
  const {charts, data, choices} = JSON.parse(part.querySelector('script[type="application/json"]').textContent);
  const views = new Map();                // by name of the chart

  const FONT = getComputedStyle(document.body).fontFamily;
  const CONFIG = {
    font: FONT, background: null, view: {stroke: '#8a9099'},
    axis: {labelFontSize: 12, titleFontSize: 12, titleFontWeight: 'normal', labelColor: '#333a42', gridColor: '#e6e9ed'},
    legend: {labelFontSize: 12, titleFontSize: 12, titleFontWeight: 'normal', symbolStrokeWidth: 2},
  };

  // Rows of the columns that the page has.
  function rowsOf(columns) {
    const names = Object.keys(columns);
    return (columns[names[0]] || []).map((_, row) => Object.fromEntries(names.map((name) => [name, columns[name][row]])));
  }

  // The names and values of a mark beside the pointer.
  const tip = part.appendChild(document.createElement('dl'));
  tip.className = 'tip';
  tip.setAttribute('role', 'tooltip');
  function showTip(_handler, event, _item, value) {
    tip.replaceChildren(...Object.entries(value || {}).flatMap(([name, text]) => {
      const pair = [document.createElement('dt'), document.createElement('dd')];
      pair[0].textContent = name;
      pair[1].textContent = text;
      return pair;
    }));
    tip.classList.toggle('shown', Boolean(value));
    const [width, height] = [tip.offsetWidth, tip.offsetHeight];
    tip.style.left = `${Math.max(4, Math.min(event.clientX + 14, document.documentElement.clientWidth - width - 4))}px`;
    tip.style.top = `${event.clientY + 14 + height > innerHeight ? event.clientY - height - 10 : event.clientY + 14}px`;
  }

  function choose(name, value) {
    for (const view of views.values()) {
      view.signal(name, value).runAsync();
    }
  }

  // What the form has chosen: all of several boxes, or else one.
  function chosen({name, values}) {
    const inputs = [...part.querySelectorAll(`[name="${name}"]`)];
    const checked = inputs.filter((input) => input.checked).map((input) => values[input.value]);
    return inputs[0].type === 'checkbox' ? checked : inputs[0].type === 'radio' ? checked[0] : values[inputs[0].value];
  }

  // A click on a mark that names the value of a choice chooses it, and shows the chart that it is for.
  function chooseMark(datum) {
    for (const {name, values, clicked_for} of choices) {
      if (clicked_for && values.includes(datum[name])) {
        part.querySelector(`[name="${name}"]`).value = values.indexOf(datum[name]);
        choose(name, datum[name]);
        document.getElementById(`chart-${clicked_for}`).scrollIntoView({block: 'nearest', behavior: 'smooth'});
      }
    }
  }

  // By this factor the part of the axes that is shown becomes larger; 0 shows all.
  function zoom(view, scales, factor) {
    for (const {name, type, domainRaw} of scales) {
      const signal = domainRaw.signal.replace(/\["(.*)"\]/, '_$1');
      const [low, high] = view.scale(name).domain();
      const [into, back] = type === 'log' ? [Math.log, Math.exp] : [Number, Number];
      const [middle, half] = [(into(low) + into(high)) / 2, factor * (into(high) - into(low)) / 2];
      view.signal(signal, factor ? [back(middle - half), back(middle + half)] : null);
    }
    view.runAsync();
  }

  async function draw({name, spec}, rows) {
    const figure = document.getElementById(`chart-${name}`);
    const drawn = vegaLite.compile({...spec, datasets: rows}, {config: CONFIG}).spec;
    const container = figure.querySelector('.drawing');
    const view = new vega.View(vega.parse(drawn), {renderer: 'svg', container, hover: true, tooltip: showTip});
    views.set(name, view);
    view.addEventListener('click', (_event, item) => item && item.datum && chooseMark(item.datum));
    const scales = drawn.scales.filter((scale) => scale.domainRaw);
    figure.querySelector('.zoom').hidden = !scales.length;
    for (const button of figure.querySelectorAll('.zoom button')) {
      button.addEventListener('click', () => zoom(view, scales, Number(button.dataset.factor)));
    }
    await view.runAsync();
  }

  async function drawAll() {
    const rows = Object.fromEntries(Object.entries(data).map(([name, columns]) => [name, rowsOf(columns)]));
    await Promise.all(charts.map((chart) => draw(chart, rows)));
    for (const choice of choices) {
      for (const input of part.querySelectorAll(`[name="${choice.name}"]`)) {
        input.addEventListener('change', () => choose(choice.name, chosen(choice)));
      }
    }
  }

  const instead = document.querySelector('.instead-of-charts');
  part.classList.add('drawn');            // before: charts are as wide as their place
  drawAll().then(() => {
    if (instead) {
      instead.open = false;
      part.classList.add('for-screen');
    }
  }, (error) => {
    part.classList.remove('drawn');
    console.warn(`no interactive charts in this browser: ${error}`);
  });
  part.views = views;                     // for those who look into them, as tests do
})();
