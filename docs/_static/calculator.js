'use strict';
// What `advise --wheel-diameter --wheel-separation --distance --turns --wheels --ppr` computes, with fewer samples: see
// docs/which_encoder.md. Constants are those of the Python package (docs/_ext/calculator.py). Units: m, rad.
(() => {
const SAMPLES = 500, SEED = 1, PER_OCTAVE = 2;
const element = (id) => document.getElementById(id);
const root = element('calculator-box'), form = root.querySelector('form');
const facts = JSON.parse(element('calculator-facts').textContent);
const [X, Y, YAW] = [0, 1, 2];

// ---- samples: the same for all settings

// Uniform in [0, 1): mulberry32 (Tommy Ettinger, 2017).
function uniform(seed) {
  return () => {
    seed = (seed + 0x6D2B79F5) | 0;
    let bits = Math.imul(seed ^ (seed >>> 15), seed | 1);
    bits ^= bits + Math.imul(bits ^ (bits >>> 7), bits | 61);
    return ((bits ^ (bits >>> 14)) >>> 0) / 4294967296;
  };
}

// Per sample: end of the drive in [-1, 1), phases of both wheels [counts], standard normals of radii and separation.
function samplesOf(seed) {
  const next = uniform(seed);
  const normal = () => Math.sqrt(-2 * Math.log(1 - next())) * Math.cos(2 * Math.PI * next());
  return Array.from({length: SAMPLES}, () => ({
    ahead: 2 * next() - 1, swing: 2 * next() - 1, phases: [next(), next()], normals: [normal(), normal(), normal()],
  }));
}
const SAMPLED = {straight: samplesOf(SEED), turns: samplesOf(SEED + 1)};

// ---- drives and their odometry

const wrapped = (angle) => angle - 2 * Math.PI * Math.floor(angle / (2 * Math.PI) + 0.5);
const sinc = (angle) => (Math.abs(angle) > 1e-4 ? Math.sin(angle) / angle : 1 - angle * angle / 6);

function arc(distance, turn) {
  const chord = distance * sinc(turn / 2);
  return [chord * Math.cos(turn / 2), chord * Math.sin(turn / 2), turn];
}

// Fractions of a drive at equally spaced count reports: speed up, cruise, slow down, stand.
function fractionsOf(distance, topSpeed, acceleration, reports) {
  const ramp = Math.min(topSpeed / acceleration, Math.sqrt(distance / acceleration));
  const duration = ramp + Math.max(ramp, distance / topSpeed);
  return Float64Array.from({length: reports}, (_, report) => {
    const time = Math.min(duration, report * (duration + facts.pause) / (reports - 1)), left = duration - time;
    if (time < ramp) return 0.5 * acceleration * time ** 2 / distance;
    if (left < ramp) return 1 - 0.5 * acceleration * left ** 2 / distance;
    return acceleration * ramp * (time - 0.5 * ramp) / distance;
  });
}

// A drive with both wheels at a constant ratio: of each sample, the true motion and the distances that odometry
// measures without rounding to counts.
function driveOf(kind, {L, std, distance, turns}) {
  const {limits} = facts, [fewest, perTurn, most] = facts.reports, isStraight = kind === 'straight';
  const straight = isStraight ? distance : 0, turn = isStraight ? 0 : 2 * Math.PI * turns;
  const reports = isStraight ? fewest : Math.min(most, Math.max(fewest, Math.ceil(perTurn * turns)));
  const fractions = isStraight ? fractionsOf(straight, limits.speed, limits.acceleration, reports)
    : fractionsOf(turn, limits.angular_speed, limits.angular_acceleration, reports);
  const samples = SAMPLED[kind].map(({ahead, swing, phases, normals}) => {
    const way = straight + facts.ends[0] * ahead, turned = turn + facts.ends[1] * swing;
    const half = 0.5 * turned * L * (1 + std * normals[2]), spread = Math.SQRT1_2 * std;
    const measured = [(way - half) / (1 + spread * normals[0]), (way + half) / (1 + spread * normals[1])];
    return {way, turned, measured, phases};
  });
  const text = isStraight ? `${distance} m straight` : `${turns} turn${turns === 1 ? '' : 's'} in place`;
  return {kind, text, way: straight, turn, fractions, samples};
}

// Pose by arcs between count reports (equation 1: floor), the heading by the totals.
function counted({measured, phases}, fractions, d, L) {
  const left = measured[0] / d, right = measured[1] / d, toHalfTurn = 0.5 * d / L;
  let x = 0, y = 0, atLeft = 0, atRight = 0;
  const [leftPhase, rightPhase] = phases;
  for (let report = 0; report < fractions.length; report++) {
    const newLeft = Math.floor(fractions[report] * left + leftPhase);
    const newRight = Math.floor(fractions[report] * right + rightPhase);
    const byLeft = newLeft - atLeft, byRight = newRight - atRight;
    if (byLeft === 0 && byRight === 0) continue;
    const chord = 0.5 * d * (byLeft + byRight) * sinc(toHalfTurn * (byRight - byLeft));
    const yaw = toHalfTurn * (atRight - atLeft + newRight - newLeft);
    x += chord * Math.cos(yaw);
    y += chord * Math.sin(yaw);
    atLeft = newLeft;
    atRight = newRight;
  }
  return [x, y, 2 * toHalfTurn * (atRight - atLeft)];
}

const difference = (pose, truth) => [pose[X] - truth[X], pose[Y] - truth[Y], wrapped(pose[YAW] - truth[YAW])];
const isWithin = (error) => error.every((each, axis) => Math.abs(each) <= facts.tolerances[axis]);

// Odometry minus truth at the end, of all samples.
function errorsOf(drive, d, L) {
  return drive.samples.map((sample) =>
    difference(counted(sample, drive.fractions, d, L), arc(sample.way, sample.turned)));
}

// The same by the wheels only, without counts, after a fraction of the drive.
function wheelErrors(drive, L, fraction) {
  return drive.samples.map(({way, turned, measured: [left, right]}) => {
    const estimated = arc(fraction * 0.5 * (left + right), fraction * (right - left) / L);
    return difference(estimated, arc(fraction * way, fraction * turned));
  });
}

// ---- statistics

function wilson(successes) {
  const share = successes / SAMPLES, z2 = facts.z ** 2, width = 2 * (SAMPLES + z2);
  const middle = (2 * SAMPLES * share + z2) / width;
  const margin = facts.z / width * Math.sqrt(4 * SAMPLES * share * (1 - share) + z2);
  return {low: successes ? middle - margin : 0, share, high: successes < SAMPLES ? middle + margin : 1};
}

function quantile(values, fraction) {
  const sorted = Float64Array.from(values).sort(), place = fraction * (sorted.length - 1), below = Math.floor(place);
  return sorted[below] + (place - below) * ((sorted[below + 1] ?? sorted[below]) - sorted[below]);
}

const rms = (values) => Math.sqrt(values.reduce((sum, each) => sum + each * each, 0) / values.length);

// Fit fractions that do not fall: neighbours that do are replaced by their mean.
function monotone(values) {
  const blocks = [];
  for (const value of values) {
    let block = {sum: value, count: 1};
    while (blocks.length && blocks.at(-1).sum / blocks.at(-1).count >= block.sum / block.count) {
      const last = blocks.pop();
      block = {sum: block.sum + last.sum, count: block.count + last.count};
    }
    blocks.push(block);
  }
  return blocks.flatMap(({sum, count}) => Array(count).fill(sum / count));
}

// ---- answers

// At the end, by d metres per count and by wheels: standard deviations [x, y, yaw]. Lowest counts for exact wheels.
function closedForm({kind, turn, way}, {D, L, std}, d) {
  const {share, tolerances, normalReach, leastPulses} = facts, isStraight = kind === 'straight';
  const cos2 = Math.cos(turn) ** 2, inPlace = [1 + cos2, 1 - cos2].map((each) => Math.sqrt(each / 24));
  const position = isStraight ? [Math.sqrt(1 / 12), way / L * Math.sqrt(1 / 6)]
    : inPlace.map((each) => (each < leastPulses ? 0 : each));
  const perCount = [...position, Math.sqrt(1 / 3) / L];
  // Two uniform phases make a triangle across a straight drive.
  const reach = isStraight ? Math.sqrt(6) * (1 - Math.sqrt(1 - share)) : normalReach;
  const needed = perCount.map((each, axis) => each * (axis === YAW ? normalReach : reach) / tolerances[axis]);
  const byWheels = isStraight ? [way / 2, way ** 2 / (2 * L), way / L] : [0, 0, turn * Math.sqrt(1.25)];
  return {
    counts: perCount.map((each) => each * d),
    wheels: byWheels.map((each) => each * std),
    lowest: Math.PI * D * Math.max(...needed),
  };
}

// The curve over the counts, coarse and then fine near the required fraction; yields between points.
function* curveOf(drives, {D, L}) {
  const points = [], [fewest, most] = facts.counts;
  const add = function* (low, high, steps) {
    for (let step = 0; step <= steps; step++) {
      const counts = Math.round(low * (high / low) ** (step / steps));
      if (points.some((point) => point.counts === counts)) continue;
      const errors = drives.map((drive) => errorsOf(drive, Math.PI * D / counts, L));
      points.push({counts, within: errors.map((each) => each.filter(isWithin).length)});
      yield;
    }
    points.sort((one, other) => one.counts - other.counts);
  };
  yield* add(fewest, most, PER_OCTAVE * Math.log2(most / fewest));
  const {fewer, enough} = lowestCounts(points);
  if (enough) yield* add(fewer, enough, facts.finePoints);
  return points;
}

// Counts that do not suffice, probably suffice, and suffice with all larger ones (undefined: none).
function lowestCounts(points) {
  const {share} = facts, worst = points.map(({within}) => wilson(Math.min(...within)));
  const certain = worst.findLastIndex(({low}) => low < share) + 1;
  const possible = worst.findLastIndex(({high}) => high < share) + 1;
  const fewer = points[Math.max(0, possible - 1)].counts, enough = points[certain]?.counts;
  const crossings = points[0].within.map((_, drive) => {
    const fit = monotone(points.map(({within}) => within[drive] / SAMPLES));
    const next = fit.findIndex((each) => each >= share);
    if (next <= 0) return points.at(next).counts;
    const part = (share - fit[next - 1]) / (fit[next] - fit[next - 1]), below = points[next - 1].counts;
    return below * (points[next].counts / below) ** part;
  });
  const likely = Math.round(Math.min(enough, Math.max(fewer, ...crossings)));
  return {fewer, likely, enough, isPossible: possible < points.length};
}

// The largest error of the wheels, and the part of its drive for which the tolerance holds.
function reachOf(drives, {L}) {
  const {tolerances, share} = facts;
  const reaches = drives.map((drive) => {
    const errors = wheelErrors(drive, L, 1);
    const ratios = errors.map((error) => error.map((each, axis) => Math.abs(each) / tolerances[axis]));
    const ofAxes = tolerances.map((_, axis) => quantile(ratios.map((each) => each[axis]), share));
    const fraction = quantile(ratios.map((each) => Math.max(...each)), share);
    return {drive, fraction, axis: ofAxes.indexOf(Math.max(...ofAxes))};
  });
  const {drive, fraction, axis} = reaches.reduce((one, other) => (other.fraction > one.fraction ? other : one));
  const holds = drive.fractions.findLast((part) =>
    wheelErrors(drive, L, part).filter(isWithin).length >= share * SAMPLES);
  return {drive, axis, error: fraction * tolerances[axis], holds};
}

// ---- texts

const rounded = (number, digits = 2) => `${+number.toPrecision(digits)}`;
const percent = (share) => `${Math.round(100 * share)} %`;
const AXES = ['along the path', 'sideways', 'of heading'];

function amount(error, axis, digits) {
  if (axis === YAW) return `${rounded(error * 180 / Math.PI, digits)}°`;
  return error >= 0.1 ? `${rounded(error, digits)} m` : `${rounded(1000 * error, digits)} mm`;
}

function answerText(points, drives, wheels) {
  const {fewer, likely, enough, isPossible} = lowestCounts(points), {text} = facts.wheels[wheels.quality];
  if (enough) {
    const between = fewer < enough ? ` (between ${fewer} and ${enough})` : '';
    return `At least ${likely} counts per wheel turn${between}, with ${text}.`;
  }
  if (isPossible) {
    return `Undecided: with ${text}, about ${percent(facts.share)} of the samples are within the tolerance at most.`;
  }
  const {drive, axis, error, holds} = reachOf(drives, wheels), allowed = amount(facts.tolerances[axis], axis, 6);
  const holdsFor = drive.kind === 'straight' ? amount(holds * drive.way, X) : `${rounded(holds * wheels.turns)} turns`;
  return `The encoder is not the limit: with ${text}, odometry is off by ${amount(error, axis)} ${AXES[axis]} after ` +
    `${drive.text}. The allowed ${allowed} hold for ${holdsFor}.`;
}

function chosenText({counts}, drives, shares) {
  const [x, , yaw] = facts.tolerances.map((each, axis) => amount(each, axis, 6));
  const parts = shares.map(({low, share, high}, drive) => `<b data-value="${share}">${percent(share)}</b> ` +
    `(${Math.round(100 * low)} to ${percent(high)}) after ${drives[drive].text}`);
  return `With ${counts} counts, within ${x} in x and y and ${yaw}, of ${SAMPLES} samples: ${parts.join('; ')}. ` +
    `Required: ${percent(facts.share)}.`;
}

// Standard deviations: sideways and heading after the straight drive, heading after turns.
function errorsTable(drives, forms, errors) {
  const head = ['Standard deviation', 'by counts', 'by wheels', `${SAMPLES} samples`, 'allowed'];
  const rows = drives.flatMap(({kind, text}, drive) => (kind === 'straight' ? [Y, YAW] : [YAW]).map((axis) => {
    const sampled = rms(errors[drive].map((error) => error[axis]));
    const values = [forms[drive].counts[axis], forms[drive].wheels[axis], sampled, facts.tolerances[axis]];
    const cells = values.map((value) => `<td data-value="${value}">${amount(value, axis)}</td>`);
    return `<tr><th>${axis === Y ? 'sideways' : 'heading'}, ${text}</th>${cells.join('')}</tr>`;
  }));
  return `<thead><tr>${head.map((each) => `<th>${each}</th>`).join('')}</tr></thead><tbody>${rows.join('')}</tbody>`;
}

// Fraction within the tolerance over the counts, with the chosen counts and their intervals.
function chart(points, drives, {counts}, shares) {
  const width = Math.max(280, element('curve').clientWidth), height = 240;
  const [left, right, top, bottom] = [42, 12, 10, 40], [fewest, most] = facts.counts.map(Math.log2);
  const x = (each) => left + (Math.log2(each) - fewest) / (most - fewest) * (width - left - right);
  const y = (share) => height - bottom - share * (height - top - bottom);
  const line = (kind, x1, y1, x2, y2) => `<line class="${kind}" x1="${x1}" y1="${y1}" x2="${x2}" y2="${y2}"/>`;
  const label = (text, atX, atY, anchor) => `<text x="${atX}" y="${atY}" text-anchor="${anchor}">${text}</text>`;
  const grid = [0, 0.2, 0.4, 0.6, 0.8, 1].map((share) =>
    line('grid', left, y(share), width - right, y(share)) + label(percent(share), left - 6, y(share) + 4, 'end'));
  const ticks = Array.from({length: Math.floor((most - fewest) / 2) + 1}, (_, tick) => 2 ** (fewest + 2 * tick));
  const scale = ticks.map((each) =>
    line('grid', x(each), y(0), x(each), y(0) + 4) + label(each, x(each), y(0) + 17, 'middle'));
  const curves = drives.map(({kind}, drive) => {
    const path = points.map((point) => `${x(point.counts).toFixed(1)},${y(point.within[drive] / SAMPLES).toFixed(1)}`);
    const {low, share, high} = shares[drive], interval = line('interval', x(counts), y(low), x(counts), y(high));
    return `<g class="${kind}"><polyline points="${path.join(' ')}"/>${interval}
      <circle cx="${x(counts)}" cy="${y(share)}" r="5"/></g>`;
  });
  const keys = drives.map(({kind, text}) => `<span class="${kind}">${text}</span>`);
  return `<svg width="${width}" height="${height}" role="img" aria-label="Fraction within the tolerance by counts">
    ${grid.join('')}${scale.join('')}${line('required', left, y(facts.share), width - right, y(facts.share))}
    ${line('chosen', x(counts), y(0), x(counts), y(1))}${curves.join('')}
    ${label('counts per wheel turn', (left + width - right) / 2, height - 6, 'middle')}</svg>
    <figcaption>Within the tolerance: ${keys.join(' ')} <span class="required">required</span>
    <span class="chosen">${counts} counts</span></figcaption>`;
}

// ---- the page

let job = 0, known = {key: '', points: []};

function update() {
  const mine = ++job, given = new FormData(form), bad = [...form.elements].find((each) => !each.validity.valid);
  for (const slider of form.querySelectorAll('[data-of]')) {
    const {name, value} = form.elements[slider.dataset.of];
    if (document.activeElement !== slider) slider.value = name === 'ppr' ? Math.log2(value) : value;
  }
  root.setAttribute('aria-busy', !bad);
  root.classList.toggle('invalid', Boolean(bad));
  if (bad) {
    const allowed = bad.options ? [...bad.options].map((each) => each.value).join(', ') : `${bad.min} to ${bad.max}`;
    element('answer').textContent = `${bad.name}: given ${bad.value || 'no number'}; allowed: ${allowed}`;
    return;
  }
  const keys = ['wheel-diameter', 'wheel-separation', 'distance', 'turns', 'ppr'], quality = given.get('wheels');
  const [D, L, distance, turns, counts] = keys.map((key) => +given.get(key)), d = Math.PI * D / counts;
  const wheels = {D, L, distance, turns, counts, quality, std: facts.wheels[quality].std};
  const drives = ['straight', ...(turns ? ['turns'] : [])].map((kind) => driveOf(kind, wheels));
  const errors = drives.map((drive) => errorsOf(drive, d, L));
  const forms = drives.map((drive) => closedForm(drive, wheels, d));
  const shares = errors.map((each) => wilson(each.filter(isWithin).length));
  const lowest = forms.map((form, drive) =>
    `${drives[drive].text} <b data-value="${form.lowest}">${Math.round(form.lowest)}</b>`);
  const command = ['rosrun diff_encoder_sim advise', ...[...given].map(([key, value]) => `--${key} ${value}`)];
  element('chosen').innerHTML = chosenText(wheels, drives, shares);
  element('errors').innerHTML = errorsTable(drives, forms, errors);
  element('closed-form').innerHTML = `Lowest counts in closed form, for exact wheels: ${lowest.join(', ')}.`;
  element('command').innerHTML = command.map((part) => `<span>${part}</span>`).join(' ');
  const key = JSON.stringify({...wheels, counts: 0}), work = key === known.key ? null : curveOf(drives, wheels);
  const show = () => {
    element('answer').textContent = answerText(known.points, drives, wheels);
    element('curve').innerHTML = chart(known.points, drives, wheels, shares);
    root.setAttribute('aria-busy', false);
  };
  const proceed = () => {
    if (mine !== job) return;
    for (const until = performance.now() + 15; performance.now() < until;) {
      const {done, value} = work.next();
      if (done) {
        known = {key, points: value};
        return show();
      }
    }
    setTimeout(proceed);
  };
  if (work) setTimeout(proceed); else show();
}

// Settings of a link: #wheel-diameter=0.2&ppr=1024
function fromLink() {
  for (const [key, value] of new URLSearchParams(location.hash.slice(1))) {
    if (form.elements[key]) form.elements[key].value = value;
  }
  update();
}

form.addEventListener('input', ({target}) => {
  const key = target.dataset.of;
  if (key) form.elements[key].value = key === 'ppr' ? Math.round(2 ** target.value) : +target.value;
  update();
});
form.addEventListener('change', () => {
  if (form.checkValidity()) history.replaceState(null, '', `#${new URLSearchParams(new FormData(form))}`);
});
form.addEventListener('submit', (event) => event.preventDefault());
addEventListener('hashchange', fromLink);
addEventListener('resize', update);
fromLink();
})();
