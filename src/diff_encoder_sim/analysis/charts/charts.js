'use strict';

// Draws the charts of a page from the JSON beside them, and lets its reader choose what they show.
addEventListener('DOMContentLoaded', () => {
  const part = document.querySelector('.charts');
  const {charts, data, choices} = JSON.parse(part.querySelector('script[type="application/json"]').textContent);
  const views = new Map();                // with the scales that can be zoomed

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

  const inputsOf = ({name}) => [...part.querySelectorAll(`.choices [name="${name}"]`)];

  // What the form has chosen: all of several boxes, or else one.
  function chosen(choice) {
    const [first, ...others] = inputsOf(choice);
    const checked = [first, ...others].filter((input) => input.checked).map((input) => choice.values[input.value]);
    return first.type === 'checkbox' ? checked : first.type === 'radio' ? checked[0] : choice.values[first.value];
  }

  // Choose in the form, as its reader would.
  function choose(choice, value) {
    const index = choice.values.indexOf(value);
    const [first, ...others] = inputsOf(choice);
    if (first.type === 'radio') {
      [first, ...others][index].checked = true;
    } else {
      first.value = index;
    }
  }

  // Offer in a list what is within another choice, and draw what is chosen.
  function show() {
    for (const choice of choices.filter(({within}) => within)) {
      const parent = chosen(choices.find(({name}) => name === choice.within));
      const options = [...inputsOf(choice)[0].options];
      for (const [index, option] of options.entries()) {
        option.hidden = option.disabled = choice.parents[index] !== parent;
      }
      if (choice.parents[inputsOf(choice)[0].value] !== parent) {
        choose(choice, choice.values[choice.parents.indexOf(parent)]);
      }
    }
    for (const view of views.keys()) {
      for (const choice of choices) {
        view.signal(choice.name, chosen(choice));
      }
      view.runAsync();
    }
  }

  // Choose what a mark or an element of the page names, and bring the chart that it is for into view.
  function chooseNamed(named) {
    for (const choice of choices) {
      const index = choice.clicked_for ? choice.values.indexOf(named[choice.name]) : -1;
      if (index >= 0) {
        if (choice.within) {
          choose(choices.find(({name}) => name === choice.within), choice.parents[index]);
        }
        choose(choice, named[choice.name]);
        show();
        document.getElementById(`chart-${choice.clicked_for}`).scrollIntoView({block: 'nearest', behavior: 'smooth'});
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

  async function draw({name, spec}) {
    const figure = document.getElementById(`chart-${name}`);
    spec.datasets = Object.fromEntries(spec.datasets.map((name) => [name, rowsOf(data[name])]));
    const look = {mode: 'vega-lite', renderer: 'svg', hover: true, tooltip: showTip, actions: false,
      logLevel: 1};                       // errors only: a chart without rows warns
    const {view, vgSpec} = await vegaEmbed(figure.querySelector('.drawing'), spec, look);
    view.addEventListener('click', (_event, item) => item && item.datum && chooseNamed(item.datum));
    const scales = vgSpec.scales.filter((scale) => scale.domainRaw);
    views.set(view, scales);
    figure.querySelector('.zoom').hidden = !scales.length;
    for (const button of figure.querySelectorAll('.zoom button')) {
      button.addEventListener('click', () => zoom(view, scales, Number(button.dataset.factor)));
    }
  }

  async function drawAll() {
    await Promise.all(charts.map(draw));
    part.addEventListener('change', () => {
      for (const [view, scales] of views) {
        zoom(view, scales, 0);            // other data has other axes
      }
      show();
    });
    for (const element of document.querySelectorAll('[data-choose]')) {
      element.hidden = false;
      element.addEventListener('click', () => chooseNamed(JSON.parse(element.dataset.choose)));
    }
    show();
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
});
