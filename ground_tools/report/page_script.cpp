#include "report/page.hpp"

namespace cairn::ground {

const char* const kPageScript = R"js('use strict';
(() => {
const data = JSON.parse(document.getElementById('data').textContent);
const el = (id) => document.getElementById(id);
const esc = (text) => String(text).replace(/[&<>"']/g, (c) => ({'&': '&amp;', '<': '&lt;', '>': '&gt;', '"': '&quot;', "'": '&#39;'}[c]));
const number = (v, digits) => (v === null || v === undefined || !isFinite(v) ? '\u2013' : v.toFixed(digits).replace(/^-(?=0\.?0*$)/, '').replace('-', '\u2212'));
const jpeg = (index) => (index >= 0 ? 'data:image/jpeg;base64,' + data.pictures[index] : '');
const file = (path) => String(path).split('/').filter((part) => part).pop() || '';
const kLabelColours = ['#E69F00', '#56B4E9', '#009E73', '#F0E442', '#CC79A7', '#D55E00', '#0072B2'];
const colourOf = (label) => kLabelColours[label % kLabelColours.length];
let run = data.runs[0];

// ---- words -------------------------------------------------------------------------------------------------------
const kVerdicts = {
  applied: 'used', no_map: 'not used: no map', no_map_boulders: 'not used: the map has no boulder near',
  no_local_boulders: 'not used: no boulder seen lately', too_few_pairs: 'not used: too few pairs of boulders',
  weak_geometry: 'not used: boulders lie too close together to tell the heading', iteration_limit: 'not used: the registration did not settle',
  beyond_limit: 'not used: the correction would be implausibly large', bad_input: 'not used: bad input', late: 'not used: not ready in time'};
const kWords = {
  vo: {first_frame: 'first frame', motion: 'motion found', bad_image: 'image missing or damaged', few_features: 'too few features',
    few_stereo: 'too few left-right matches', few_matches: 'too few matches to the frame before', no_consensus: 'matches disagree', implausible: 'implausible motion'},
  boulders: {boulders: 'boulders seen', no_boulders: 'nothing stands above the ground', no_regions: 'no regions', no_points: 'no 3D points', bad_input: 'bad input', running: 'not finished in time', idle: 'not looked for'},
  fixes: {...kVerdicts, applied: 'used: the pose was corrected'}};
const word = (kind, status) => (kWords[kind] && kWords[kind][status]) || status;
const mapWords = (s) => (!s.map ? 'no map' : s.map_pixel_m > 0 ? file(s.map) + ', ' + +(100 * s.map_pixel_m).toFixed(2) + ' cm/px' : file(s.map));
const voWords = (s) => (s.degrade ? 'worsened on purpose: ' + s.degrade.replace(/,/g, ', ') : 'as it is');
const appliedOf = (r) => r.fixes.status.filter((s) => s === 'applied').length;

function showLead() {
  const s = run.summary;
  const applied = appliedOf(run), all = run.fixes.status.length;
  const fixes = all === 0 ? 'No fix was tried.' : applied + ' of ' + all + ' tries to correct the position by boulders were used.';
  if (!run.errors) {
    el('lead').textContent = s.frames + ' stereo pairs of ' + file(s.dataset) + '. The true path is not known, so no error can be told. ' + fixes;
    return;
  }
  el('lead').textContent = 'The rover drove ' + number(s.path_m, 1) + ' m and took ' + s.frames + ' stereo pairs. By visual odometry alone' +
    (s.degrade ? ' (worsened on purpose)' : '') + ' its position in x and y ended ' + number(s.vo.end_xy_m, 2) + ' m off; corrected by boulders, ' +
    number(s.corrected.end_xy_m, 2) + ' m. ' + fixes;
  el('errors-words').textContent = 'Each dotted line is a fix that was used. Over the whole drive the corrected position was at most ' +
    number(s.corrected.largest_xy_m, 3) + ' m off in x and y (VO alone: ' + number(s.vo.largest_xy_m, 3) + ' m). ' +
    (s.largest_excess_over_vo_m > 0 ? 'Where VO is still good, a map of limited accuracy can make things worse: by ' +
      number(s.largest_excess_over_vo_m, 3) + ' m at most here.' : 'It was never worse than VO alone.');
}

// ---- tables ------------------------------------------------------------------------------------------------------
const row = (cells) => '<tr>' + cells.map((c) => (typeof c === 'string' ? '<td>' + c + '</td>' : '<td class="' + c.as + '">' + c.text + '</td>')).join('') + '</tr>';
const words = (text, as) => ({text, as: 'words' + (as ? ' ' + as : '')});

function showRuns() {
  const pairs = [['end_xy_m', 'end,<br>x y', 3], ['largest_xy_m', 'largest,<br>x y', 3], ['end_3d_m', 'end,<br>3D', 3], ['end_yaw_deg', 'end,<br>yaw', 2], ['end_rotation_deg', 'end,<br>rotation', 2]];
  const part = (s, name) => pairs.map(([key, , digits]) => (s[name] ? number(s[name][key], digits) : '\u2013'));
  const heads = pairs.map(([, head]) => '<th>' + head + '</th>').join('');
  let html = '<thead><tr><th rowspan="2" class="words">run</th><th rowspan="2" class="words">map</th><th rowspan="2" class="words">VO</th><th rowspan="2">driven,<br>m</th>' +
    '<th colspan="5" class="group">VO alone</th><th colspan="5" class="group">corrected</th><th colspan="2" class="group">fixes</th><th rowspan="2">boulders<br>found</th></tr><tr>' +
    heads + heads + '<th>used</th><th>not</th></tr></thead><tbody>';
  data.runs.forEach((r, i) => {
    const s = r.summary, used = appliedOf(r);
    const name = data.runs.length > 1 ? '<button type="button" class="link" data-run="' + i + '">' + esc(r.name) + '</button>' : esc(r.name);
    html += row([words(name), words(esc(mapWords(s)), 'wrap'), words(esc(voWords(s) + (s.variant === 'paper' ? ', the paper\u2019s variant' : '')), 'wrap'), number(s.path_m, 1), ...part(s, 'vo'), ...part(s, 'corrected'),
      String(used), String(r.fixes.status.length - used), String(r.ground.id.length)]);
  });
  el('runs').innerHTML = html + '</tbody>';
  el('runs').querySelectorAll('[data-run]').forEach((b) => b.addEventListener('click', () => choose(+b.dataset.run)));
}

function showFixes() {
  const f = run.fixes;
  if (f.frame.length === 0) { el('fixes').innerHTML = '<tbody><tr><td class="words">This run tried no fix.</td></tr></tbody>'; return; }
  let html = '<thead><tr><th>frame</th><th>driven,<br>m</th><th class="words">verdict</th><th>pairs</th><th>rejected<br>as worst</th><th>without<br>partner</th>' +
    '<th>remains,<br>m</th><th>sigma<br>x, y, m</th><th>moved by<br>x, y, m</th><th>turned,<br>degrees</th><th>error<br>before, m</th><th>error<br>after, m</th><th class="words"></th></tr></thead><tbody>';
  f.frame.forEach((frame, i) => {
    const used = f.status[i] === 'applied', known = f.before_m[i] !== null && used;
    const change = known ? f.after_m[i] - f.before_m[i] : 0;
    html += row(['<button type="button" class="link" data-fix="' + i + '" aria-label="Show the fix of frame ' + frame + ' on the map">' + frame + '</button>',
      number(f.distance_m[i], 1), words(esc(kVerdicts[f.status[i]] || f.status[i]), 'wrap'), String(f.pairs[i]), String(f.trimmed[i]), String(f.gated[i]), number(f.rms_m[i], 3),
      number(f.sigma_x_m[i], 3) + ', ' + number(f.sigma_y_m[i], 3), used ? number(f.dx_m[i], 3) + ', ' + number(f.dy_m[i], 3) : '\u2013',
      used ? number(f.dyaw_deg[i], 2) : '\u2013', number(f.before_m[i], 3), number(f.after_m[i], 3),
      words(!known ? '' : change < -0.0005 ? '<span class="better">\u25bc better</span>' : change > 0.0005 ? '<span class="worse">\u25b2 worse</span>' : 'same')]);
  });
  el('fixes').innerHTML = html + '</tbody>';
  el('fixes').querySelectorAll('[data-fix]').forEach((b) => b.addEventListener('click', () => { map.showFix(+b.dataset.fix); el('mapbox').scrollIntoView({block: 'center'}); el('map').focus({preventScroll: true}); }));
}

function median(values) {
  const sorted = [...values].sort((a, b) => a - b);
  return sorted.length ? sorted[sorted.length >> 1] : 0;
}

function showWork() {
  const f = run.frames;
  const jobs = [['visual odometry', f.vo_ops, f.vo_ms], ['boulders: segmentation, 3D points, labels', f.boulder_ops, f.boulder_ms], ['registration, where it ran', f.fix_ops, f.fix_ms]];
  const whole = f.ms.reduce((a, b) => a + b, 0) || 1;
  let html = '<thead><tr><th class="words">job</th><th>frames</th><th>million operations<br>median</th><th><br>most</th><th>milliseconds<br>median</th><th><br>longest</th><th>share of<br>the time</th></tr></thead><tbody>';
  for (const [name, ops, ms] of jobs) {
    const ran = ops.map((v, i) => i).filter((i) => ops[i] > 0);
    const most = (list) => ran.reduce((m, i) => Math.max(m, list[i]), 0);
    html += row([words(name), String(ran.length), number(median(ran.map((i) => ops[i])) / 1e6, 3), number(most(ops) / 1e6, 3), number(median(ran.map((i) => ms[i])), 2),
      number(most(ms), 2), number(100 * ms.reduce((a, b) => a + b, 0) / whole, 1) + ' %']);
  }
  html += row([words('whole frame'), String(f.ms.length), '\u2013', '\u2013', number(median(f.ms), 2), number(f.ms.reduce((a, b) => Math.max(a, b), 0), 2), '100 %']);
  el('work').innerHTML = html + '</tbody>';
  const memory = Object.entries(run.summary.memory_bytes);
  const largest = memory.reduce((m, [, bytes]) => Math.max(m, bytes), 1);
  el('memory').innerHTML = '<thead><tr><th class="words">part</th><th>KiB</th><th class="words"></th></tr></thead><tbody>' + memory.map(([name, bytes]) =>
    row([words(esc(name).replace(/^ +/, '&emsp;')), number(bytes / 1024, 0), words('<span class="bar" style="width:' + (80 * bytes / largest).toFixed(0) + 'px"></span>')])).join('') + '</tbody>';
  const counts = run.summary.counts, kinds = [['visual odometry', 'vo'], ['boulders', 'boulders'], ['fixes', 'fixes'], ['over budget', 'overruns']];
  html = '<thead><tr><th class="words">job</th><th class="words">what became of it</th><th>times</th></tr></thead><tbody>';
  for (const [name, key] of kinds) for (const [status, times] of Object.entries(counts[key])) html += row([words(name), words(esc(word(key, status)), 'wrap'), String(times)]);
  for (const [key, times] of Object.entries(counts)) if (typeof times === 'number' && times > 0) html += row([words('other'), words(esc(key.replace(/_/g, ' ')), 'wrap'), String(times)]);
  el('counts').innerHTML = html + '</tbody>';
}

// ---- charts ------------------------------------------------------------------------------------------------------
function niceStep(span, count) {
  const raw = span / count, power = Math.pow(10, Math.floor(Math.log10(raw)));
  return [1, 2, 5, 10].map((f) => f * power).find((step) => raw <= step * 1.0000001);
}
const decimals = (step) => Math.max(0, Math.min(6, Math.ceil(-Math.log10(step) - 1e-9)));

/// what: {title, unit, digits, x, xName, series: [{name, colour, dash, y}], marks: [x]}; pick(i) is told what is pointed at.
function drawChart(box, what, pick) {
  const figure = document.createElement('figure');
  figure.className = 'chart';
  figure.innerHTML = '<figcaption>' + esc(what.title) + '</figcaption><div class="said"></div><svg tabindex="0" role="img"></svg>';
  box.appendChild(figure);
  const svg = figure.querySelector('svg'), said = figure.querySelector('.said');
  svg.setAttribute('aria-label', what.title + '. Arrow keys go along the curve.');
  const xs = what.series.map((s) => s.x || what.x);
  const far = Math.max(1e-6, ...xs.map((x) => x.reduce((m, v) => Math.max(m, v), 0)));
  let low = 0, high = 0;
  for (const s of what.series) for (const v of s.y) { if (v < low) low = v; if (v > high) high = v; }
  if (high - low < 1e-9) high = low + 1;
  const stepY = niceStep((high - low) * 1.05, 4);
  low = Math.floor(low / stepY + 1e-9) * stepY;
  high = Math.ceil(high / stepY - 1e-9) * stepY;
  const height = 220, left = 50, right = 12, top = 10, bottom = 40;
  let width = 0, at = -1;
  const px = (x) => left + x / far * (width - left - right);
  const py = (y) => top + (high - y) / (high - low) * (height - top - bottom);
  const say = () => {
    const key = (s) => '<span><i' + (s.dash ? ' class="dashed"' : '') + ' style="border-color:' + s.colour + '"></i>' + esc(s.name);
    const value = (s) => (at < 0 || !s.y.length ? '' : ': <b>' + number(s.y[Math.min(at, s.y.length - 1)], what.digits) + '</b>');
    const x0 = xs[0];
    said.innerHTML = what.series.map((s) => key(s) + value(s) + '</span>').join('') +
      (at < 0 ? '' : '<span>at ' + number(x0[Math.min(at, x0.length - 1)], 1) + ' m</span>');
  };
  const hair = () => {
    const line = svg.querySelector('.hair');
    if (!line) return;
    const x = at < 0 ? -10 : px(xs[0][Math.min(at, xs[0].length - 1)]);
    line.setAttribute('x1', x);
    line.setAttribute('x2', x);
  };
  const paint = () => {
    width = Math.max(260, svg.clientWidth || box.clientWidth || 300);
    svg.setAttribute('viewBox', '0 0 ' + width + ' ' + height);
    svg.setAttribute('height', height);
    let out = '';
    for (let y = low; y <= high + stepY * 1e-6; y += stepY) {
      out += '<line class="grid" x1="' + left + '" x2="' + (width - right) + '" y1="' + py(y) + '" y2="' + py(y) + '"/>' +
        '<text x="' + (left - 6) + '" y="' + (py(y) + 4) + '" text-anchor="end">' + number(Math.abs(y) < stepY * 1e-6 ? 0 : y, decimals(stepY)) + '</text>';
    }
    const stepX = niceStep(far, Math.max(3, Math.floor(width / 80)));
    for (let x = 0; x <= far * 1.000001; x += stepX) out += '<text x="' + px(x) + '" y="' + (height - bottom + 17) + '" text-anchor="middle">' + number(x, decimals(stepX)) + '</text>';
    out += '<text x="' + (left + width - right) / 2 + '" y="' + (height - 5) + '" text-anchor="middle">' + esc(what.xName) + '</text>';
    for (const x of what.marks || []) out += '<line class="fixline" x1="' + px(x) + '" x2="' + px(x) + '" y1="' + top + '" y2="' + (height - bottom) + '"/>';
    what.series.forEach((s, k) => {
      const points = s.y.map((v, i) => px(xs[k][i]).toFixed(1) + ',' + py(v).toFixed(1)).join(' ');
      out += '<polyline class="curve" style="stroke:' + s.colour + '"' + (s.dash ? ' stroke-dasharray="' + s.dash + '"' : '') + ' points="' + points + '"/>';
    });
    svg.innerHTML = out + '<line class="hair" x1="-10" x2="-10" y1="' + top + '" y2="' + (height - bottom) + '"/>';
    hair();
  };
  const goTo = (i) => {
    at = Math.max(-1, Math.min(xs[0].length - 1, i));
    say();
    hair();
    if (pick) pick(at);
  };
  svg.addEventListener('pointermove', (e) => {
    const box = svg.getBoundingClientRect();
    const x = ((e.clientX - box.left) / box.width * width - left) / (width - left - right) * far;
    let best = 0;
    xs[0].forEach((v, i) => { if (Math.abs(v - x) < Math.abs(xs[0][best] - x)) best = i; });
    goTo(best);
  });
  svg.addEventListener('pointerleave', () => goTo(-1));
  svg.addEventListener('blur', () => goTo(-1));
  svg.addEventListener('keydown', (e) => {
    const step = {ArrowLeft: -1, ArrowRight: 1, PageDown: 10, PageUp: -10}[e.key];
    if (step) { e.preventDefault(); goTo(Math.max(0, at + step)); }
  });
  say();
  paint();
  new ResizeObserver(() => { if (svg.clientWidth && Math.abs(svg.clientWidth - width) > 1) paint(); }).observe(svg);
}

const kErrorCharts = [['xy_m', 'Position error in x and y, m', 3], ['xyz_m', 'Position error in 3D, m', 3], ['yaw_deg', 'Heading (yaw) error, degrees', 3], ['rotation_deg', 'Whole rotation error, degrees', 3]];
function showCharts() {
  const box = el('charts');
  box.innerHTML = '';
  if (!run.errors) {
    el('errors-words').textContent = '';
    box.innerHTML = '<p class="note">The data set has no true path, so there are no errors to draw.</p>';
    return;
  }
  const marks = run.fixes.distance_m.filter((d, i) => run.fixes.status[i] === 'applied');
  const pick = run.errors.distance_m.length === run.frames.frame.length ? (i) => map.pointAt(i) : null;
  for (const [key, title, digits] of kErrorCharts) {
    drawChart(box, {title, digits, x: run.errors.distance_m, xName: 'distance driven, m', marks,
      series: [{name: 'VO alone', colour: 'var(--vo)', dash: '8 4', y: run.errors.vo[key]}, {name: 'corrected', colour: 'var(--corrected)', y: run.errors.corrected[key]}]}, pick);
  }
}

function showTogether() {
  const told = data.runs.filter((r) => r.errors);
  if (told.length < 2) return;
  el('together').hidden = false;
  const colours = ['var(--corrected)', 'var(--vo)', 'var(--third)', '#CC79A7', '#E69F00', '#56B4E9', 'var(--dim)'];
  for (const [key, title] of [['xy_m', 'Corrected: position error in x and y, m'], ['rotation_deg', 'Corrected: whole rotation error, degrees']]) {
    drawChart(el('all-charts'), {title, digits: 3, xName: 'distance driven, m', x: told[0].errors.distance_m,
      series: told.map((r, i) => ({name: r.name, colour: colours[i % 7], dash: ['', '8 4', '2 3'][Math.floor(i / 7) % 3], x: r.errors.distance_m, y: r.errors.corrected[key]}))});
  }
}

function showWorkCharts() {
  const f = run.frames, box = el('work-charts');
  box.innerHTML = '';
  if (!f.frame.length) return;
  for (const [title, keys, unit] of [['Million operations a frame', ['vo_ops', 'boulder_ops', 'fix_ops'], 1e6], ['Milliseconds a frame', ['vo_ms', 'boulder_ms', 'fix_ms'], 1]]) {
    drawChart(box, {title, digits: 1, x: f.distance_m, xName: 'distance driven, m', series: [['visual odometry', 'var(--vo)', ''], ['boulders', 'var(--corrected)', ''], ['registration', 'var(--third)', '3 3']]
      .map(([name, colour, dash], i) => ({name, colour, dash, y: f[keys[i]].map((v) => v / unit)}))});
  }
}
)js"
                                R"js(
// ---- map ---------------------------------------------------------------------------------------------------------
const map = (() => {
  const canvas = el('map'), tip = el('map-tip'), context = canvas.getContext('2d');
  const kLayers = [['ortho', 'orbital image'], ['orbital', 'boulder of the map'], ['ground', 'boulder seen by the rover'], ['truth', 'true path'], ['vo', 'VO alone'],
    ['corrected', 'corrected'], ['fixes', 'fix (hollow: not used)'], ['ellipses', 'uncertainty after it (1 sigma)']];
  const kTruth = '#000000', kVo = '#D55E00', kCorrected = '#0072B2', kFix = '#CC79A7', kOrbital = '#F0E442', kGround = '#56B4E9';
  const on = {};
  let view = {x: 0, y: 0, scale: 1}, image = null, larger = 1, hot = null, cursor = -1, waiting = false, fixAt = -1, fitted = true;
  const px = (x) => canvas.clientWidth / 2 + (x - view.x) * view.scale;
  const py = (y) => canvas.clientHeight / 2 - (y - view.y) * view.scale;
  const mx = (u) => view.x + (u - canvas.clientWidth / 2) / view.scale;
  const my = (v) => view.y - (v - canvas.clientHeight / 2) / view.scale;

  function extent() {
    let x0 = Infinity, y0 = Infinity, x1 = -Infinity, y1 = -Infinity;
    for (const path of Object.values(run.paths)) for (let i = 0; i < path.length; i += 2) {
      x0 = Math.min(x0, path[i]); x1 = Math.max(x1, path[i]); y0 = Math.min(y0, path[i + 1]); y1 = Math.max(y1, path[i + 1]);
    }
    return x0 <= x1 ? [x0, y0, x1, y1] : [0, 0, 1, 1];
  }
  function fit() {
    const [x0, y0, x1, y1] = extent(), margin = Math.max(1, 0.06 * Math.max(x1 - x0, y1 - y0));
    view.x = (x0 + x1) / 2;
    view.y = (y0 + y1) / 2;
    view.scale = Math.min(canvas.clientWidth / (x1 - x0 + 2 * margin), canvas.clientHeight / (y1 - y0 + 2 * margin));
    fitted = true;
    redraw();
  }
  function zoom(factor, u, v) {
    const scale = Math.max(0.5, Math.min(5000, view.scale * factor));
    const x = mx(u), y = my(v);
    view.scale = scale;
    view.x = x - (u - canvas.clientWidth / 2) / scale;
    view.y = y + (v - canvas.clientHeight / 2) / scale;
    fitted = false;
    redraw();
  }
  function move(du, dv) {
    view.x -= du / view.scale;
    view.y += dv / view.scale;
    fitted = false;
    redraw();
  }
  function redraw() {
    if (waiting) return;
    waiting = true;
    requestAnimationFrame(() => { waiting = false; draw(); });
  }
  function drawPath(path, colour, width, dash) {
    for (const [stroke, wide, pattern] of [['rgba(255,255,255,0.6)', width + 1.6, []], [colour, width, dash]]) {
      context.beginPath();
      for (let i = 0; i < path.length; i += 2) {
        if (i === 0) context.moveTo(px(path[0]), py(path[1])); else context.lineTo(px(path[i]), py(path[i + 1]));
      }
      context.setLineDash(pattern);
      context.strokeStyle = stroke;
      context.lineWidth = wide;
      context.stroke();
    }
    context.setLineDash([]);
  }
  function drawDiscs(xs, ys, sizes, least, style) {
    for (let i = 0; i < xs.length; ++i) {
      const u = px(xs[i]), v = py(ys[i]), r = Math.max(least, 0.5 * sizes[i] * view.scale);
      if (u < -r || v < -r || u > canvas.clientWidth + r || v > canvas.clientHeight + r) continue;
      context.beginPath();
      context.arc(u, v, r, 0, 2 * Math.PI);
      style();
    }
  }
  function diamond(u, v, size, used) {
    context.beginPath();
    context.moveTo(u, v - size); context.lineTo(u + size, v); context.lineTo(u, v + size); context.lineTo(u - size, v); context.closePath();
    context.fillStyle = used ? kFix : 'rgba(255,255,255,0.85)';
    context.strokeStyle = used ? '#ffffff' : '#8F3F6B';
    context.lineWidth = used ? 1.4 : 2;
    context.fill();
    context.stroke();
  }
  function ellipseOf(i) {  // half axes (m) and the direction of the longer one
    const f = run.fixes, a = f.sigma_x_m[i] ** 2, b = f.sigma_y_m[i] ** 2, c = f.correlation_xy[i] * f.sigma_x_m[i] * f.sigma_y_m[i];
    const mean = (a + b) / 2, root = Math.hypot((a - b) / 2, c);
    return [Math.sqrt(Math.max(0, mean + root)), Math.sqrt(Math.max(0, mean - root)), Math.atan2(2 * c, a - b) / 2];
  }
  function drawFixes() {
    const f = run.fixes;
    f.frame.forEach((frame, i) => {
      const u = px(f.x_m[i]), v = py(f.y_m[i]), used = f.status[i] === 'applied';
      if (on.ellipses && used) {
        const [long, short, angle] = ellipseOf(i);
        context.beginPath();
        context.ellipse(u, v, larger * long * view.scale, larger * short * view.scale, -angle, 0, 2 * Math.PI);
        context.fillStyle = 'rgba(204,121,167,0.18)';
        context.fill();
        for (const [stroke, wide] of [['rgba(255,255,255,0.9)', 3], ['#8F3F6B', 1.5]]) { context.strokeStyle = stroke; context.lineWidth = wide; context.stroke(); }
      }
      if (!on.fixes) return;
      if (used) {
        context.beginPath();
        context.moveTo(px(f.x_m[i] - larger * f.dx_m[i]), py(f.y_m[i] - larger * f.dy_m[i]));
        context.lineTo(u, v);
        for (const [stroke, wide] of [['#ffffff', 4], ['#8F3F6B', 2]]) { context.strokeStyle = stroke; context.lineWidth = wide; context.stroke(); }
      }
      diamond(u, v, 7, used);
    });
  }
  function drawScale() {
    const metres = niceStep(canvas.clientWidth / view.scale, 9), length = metres * view.scale, v = canvas.clientHeight - 16;
    context.fillStyle = 'rgba(255,255,255,0.8)';
    context.fillRect(8, v - 24, length + 16, 32);
    context.fillRect(8, 8, 30, 46);
    context.strokeStyle = context.fillStyle = '#000000';
    context.lineWidth = 2;
    context.beginPath();
    context.moveTo(16, v - 4); context.lineTo(16, v + 2); context.lineTo(16 + length, v + 2); context.lineTo(16 + length, v - 4);
    context.stroke();
    context.font = '12px system-ui, Arial, sans-serif';
    context.textAlign = 'center';
    context.fillText(+metres.toFixed(3) + ' m', 16 + length / 2, v - 8);
    context.beginPath();
    context.moveTo(23, 12); context.lineTo(29, 32); context.lineTo(23, 28); context.lineTo(17, 32); context.closePath();
    context.fill();
    context.fillText('N', 23, 48);
  }
  function draw() {
    const ratio = window.devicePixelRatio || 1, width = canvas.clientWidth, height = canvas.clientHeight;
    if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) { canvas.width = Math.round(width * ratio); canvas.height = Math.round(height * ratio); }
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.fillStyle = '#b4b4b4';
    context.fillRect(0, 0, width, height);
    if (on.ortho && image && image.complete && image.naturalWidth) {
      const [x0, y0] = run.ortho.low_m, [x1, y1] = run.ortho.high_m;
      context.globalAlpha = 0.8;
      context.drawImage(image, px(x0), py(y1), (x1 - x0) * view.scale, (y1 - y0) * view.scale);
      context.globalAlpha = 1;
    }
    if (on.orbital) drawDiscs(run.orbital.x_m, run.orbital.y_m, run.orbital.diameter_m, 2.5, () => {
      context.strokeStyle = 'rgba(0,0,0,0.55)'; context.lineWidth = 3; context.stroke();
      context.strokeStyle = kOrbital; context.lineWidth = 1.6; context.stroke();
    });
    if (on.ground) drawDiscs(run.ground.x, run.ground.y, run.ground.size, 3, () => {
      context.fillStyle = 'rgba(86,180,233,0.75)'; context.fill();
      context.strokeStyle = '#ffffff'; context.lineWidth = 1; context.stroke();
    });
    if (on.truth) drawPath(run.paths.truth, kTruth, 6, []);
    if (on.vo) drawPath(run.paths.vo, kVo, 2.2, [8, 4]);
    if (on.corrected) drawPath(run.paths.corrected, kCorrected, 2.2, []);
    drawFixes();
    const ring = (x, y, r) => {
      context.beginPath();
      context.arc(px(x), py(y), r, 0, 2 * Math.PI);
      for (const [stroke, wide] of [['#000000', 4.5], ['#ffffff', 2.2]]) { context.strokeStyle = stroke; context.lineWidth = wide; context.stroke(); }
    };
    if (cursor >= 0) for (const [name, path] of Object.entries(run.paths)) if (on[name] && 2 * cursor + 1 < path.length) ring(path[2 * cursor], path[2 * cursor + 1], 6);
    if (hot) ring(hot.x, hot.y, Math.max(10, hot.r * view.scale + 4));
    drawScale();
    el('map-shown').textContent = 'Shown: ' + number(width / view.scale, width / view.scale < 10 ? 2 : 1) + ' m across.';
  }
  function fixTip(i) {
    const f = run.fixes, used = f.status[i] === 'applied', [long, short] = ellipseOf(i);
    return {x: f.x_m[i], y: f.y_m[i], r: 0, text: 'Fix at frame ' + f.frame[i] + ', ' + number(f.distance_m[i], 1) + ' m driven\n' + word('fixes', f.status[i]) +
      (used ? '\nmoved by ' + number(f.dx_m[i], 3) + ', ' + number(f.dy_m[i], 3) + ' m; ' + f.pairs[i] + ' pairs of boulders, ' + number(f.rms_m[i], 3) + ' m apart' +
      '\nuncertainty ' + number(long, 3) + ' by ' + number(short, 3) + ' m' : '') +
      (f.after_m[i] !== null && used ? '\nerror ' + number(f.before_m[i], 3) + ' m before, ' + number(f.after_m[i], 3) + ' m after' : '')};
  }
  /// The thing nearest to a place on the screen: fixes first, then boulders, then paths.
  function nearest(u, v) {
    let best = null, least = 14;
    const offer = (x, y, reach, make) => {
      const d = Math.hypot(px(x) - u, py(y) - v) - reach;
      if (d < least) { least = d; best = make; }
    };
    if (on.fixes) run.fixes.frame.forEach((frame, i) => offer(run.fixes.x_m[i], run.fixes.y_m[i], 0, () => fixTip(i)));
    if (best) return best();
    least = 5;
    const g = run.ground, o = run.orbital;
    if (on.ground) g.id.forEach((id, i) => offer(g.x[i], g.y[i], Math.max(2.5, 0.5 * g.size[i] * view.scale), () => ({x: g.x[i], y: g.y[i], r: g.size[i] / 2,
      text: 'Boulder ' + id + ', seen by the rover\n' + number(g.size[i], 2) + ' m wide, seen in ' + g.sightings[i] + ' frames'})));
    if (on.orbital) o.x_m.forEach((x, i) => offer(x, o.y_m[i], Math.max(2.5, 0.5 * o.diameter_m[i] * view.scale), () => ({x, y: o.y_m[i], r: o.diameter_m[i] / 2,
      text: 'Boulder of the orbital map\n' + number(o.diameter_m[i], 2) + ' m wide'})));
    if (best) return best();
    least = 8;
    const names = {truth: 'True path', vo: 'VO alone', corrected: 'Corrected path'};
    for (const name of ['corrected', 'vo', 'truth']) {
      const path = run.paths[name];
      if (on[name]) for (let i = 0; i < path.length; i += 2) offer(path[i], path[i + 1], 0, () => {
        const k = i / 2, told = run.errors && name !== 'truth' && run.errors.distance_m.length === run.frames.frame.length;
        const known = name !== 'truth' || path.length === 2 * run.frames.frame.length;
        return {x: path[i], y: path[i + 1], r: 0, text: names[name] + (known ? ', frame ' + run.frames.frame[k] + '\n' + number(run.frames.distance_m[k], 1) + ' m driven' : '') +
          (told ? ', error ' + number(run.errors[name].xy_m[k], 3) + ' m' : '')};
      });
    }
    return best && best();
  }
  function tell(thing) {
    hot = thing;
    tip.hidden = !thing;
    if (thing) {
      tip.textContent = thing.text;
      const u = px(thing.x), v = py(thing.y), wide = tip.offsetWidth, high = tip.offsetHeight;
      tip.style.left = Math.max(4, Math.min(canvas.clientWidth - wide - 4, u + 14 + wide > canvas.clientWidth - 4 ? u - wide - 14 : u + 14)) + 'px';
      tip.style.top = Math.max(4, Math.min(canvas.clientHeight - high - 4, v + 14)) + 'px';
    }
    redraw();
  }
  function showFix(i) {
    const f = run.fixes;
    if (!f.frame.length) return;
    fixAt = (i + f.frame.length) % f.frame.length;
    view.x = f.x_m[fixAt];
    view.y = f.y_m[fixAt];
    view.scale = Math.max(view.scale, canvas.clientWidth / 8);
    fitted = false;
    tell(fixTip(fixAt));
  }
  const touches = new Map();
  canvas.addEventListener('pointerdown', (e) => { canvas.setPointerCapture(e.pointerId); touches.set(e.pointerId, [e.offsetX, e.offsetY]); canvas.classList.add('dragged'); tell(nearest(e.offsetX, e.offsetY)); });
  canvas.addEventListener('pointermove', (e) => {
    const before = touches.get(e.pointerId);
    if (!before) { tell(nearest(e.offsetX, e.offsetY)); return; }
    if (touches.size === 1) {
      move(e.offsetX - before[0], e.offsetY - before[1]);
      if (Math.hypot(e.offsetX - before[0], e.offsetY - before[1]) > 2) tell(null);
    } else if (touches.size === 2) {
      const other = [...touches].find(([id]) => id !== e.pointerId)[1];
      const was = Math.hypot(before[0] - other[0], before[1] - other[1]), is = Math.hypot(e.offsetX - other[0], e.offsetY - other[1]);
      if (was > 1) zoom(is / was, (e.offsetX + other[0]) / 2, (e.offsetY + other[1]) / 2);
      move((e.offsetX - before[0]) / 2, (e.offsetY - before[1]) / 2);
      tell(null);
    }
    touches.set(e.pointerId, [e.offsetX, e.offsetY]);
  });
  for (const end of ['pointerup', 'pointercancel']) canvas.addEventListener(end, (e) => { touches.delete(e.pointerId); if (!touches.size) canvas.classList.remove('dragged'); });
  canvas.addEventListener('pointerleave', () => { if (!touches.size) tell(null); });
  canvas.addEventListener('wheel', (e) => { e.preventDefault(); zoom(Math.exp(-Math.max(-120, Math.min(120, e.deltaY)) / 300), e.offsetX, e.offsetY); tell(null); }, {passive: false});
  const middle = (factor) => { zoom(factor, canvas.clientWidth / 2, canvas.clientHeight / 2); tell(null); };
  canvas.addEventListener('keydown', (e) => {
    const step = 60, keys = {ArrowLeft: () => move(step, 0), ArrowRight: () => move(-step, 0), ArrowUp: () => move(0, step), ArrowDown: () => move(0, -step), '+': () => middle(1.4), '=': () => middle(1.4),
      '-': () => middle(1 / 1.4), '0': () => { tell(null); fit(); }, n: () => showFix(fixAt + 1), p: () => showFix(Math.max(fixAt, 0) - 1), Escape: () => tell(null)};
    const action = keys[e.key.length === 1 ? e.key.toLowerCase() : e.key];
    if (!action || e.ctrlKey || e.metaKey || e.altKey) return;
    e.preventDefault();
    action();
  });
  el('zoom-in').addEventListener('click', () => middle(1.6));
  el('zoom-out').addEventListener('click', () => middle(1 / 1.6));
  el('zoom-all').addEventListener('click', () => { tell(null); fit(); });
  new ResizeObserver(() => { if (fitted) fit(); else redraw(); }).observe(canvas);

  function swatch(name) {
    const plate = '<svg width="30" height="18" viewBox="0 0 30 18" aria-hidden="true"><rect width="30" height="18" fill="#b4b4b4"/>';
    const line = (colour, wide, dash) => '<path d="M2 9h26" stroke="#fff" stroke-width="' + (wide + 2) + '"/><path d="M2 9h26" stroke="' + colour + '" stroke-width="' + wide + '" stroke-dasharray="' + dash + '"/>';
    return plate + {ortho: '<rect width="30" height="18" fill="#8d7763"/><circle cx="10" cy="8" r="3" fill="#5d4d40"/><circle cx="21" cy="11" r="2" fill="#5d4d40"/>',
      orbital: '<circle cx="15" cy="9" r="5" fill="none" stroke="#0009" stroke-width="3.5"/><circle cx="15" cy="9" r="5" fill="none" stroke="' + kOrbital + '" stroke-width="2"/>',
      ground: '<circle cx="15" cy="9" r="5" fill="' + kGround + '" stroke="#fff"/>', truth: line(kTruth, 5, ''), vo: line(kVo, 2.4, '7 3'), corrected: line(kCorrected, 2.4, ''),
      fixes: '<path d="M15 2l6 7-6 7-6-7z" fill="' + kFix + '" stroke="#fff"/>', ellipses: '<ellipse cx="15" cy="9" rx="9" ry="5" fill="#cc79a755" stroke="#8F3F6B" stroke-width="1.5"/>'}[name] + '</svg>';
  }
  function enlargement() {  // the longest correction or half axis at most a 15th of the view
    const f = run.fixes, [x0, y0, x1, y1] = extent();
    let longest = 1e-6;
    f.frame.forEach((frame, i) => { if (f.status[i] === 'applied') longest = Math.max(longest, Math.hypot(f.dx_m[i], f.dy_m[i]), f.sigma_x_m[i], f.sigma_y_m[i]); });
    return [50, 20, 10, 5, 2, 1].find((k) => k * longest <= Math.max(x1 - x0, y1 - y0) / 15) || 1;
  }
  function show() {
    const there = {ortho: run.ortho !== null, orbital: run.orbital.x_m.length, ground: run.ground.id.length, truth: run.paths.truth.length, vo: 1, corrected: 1, fixes: run.fixes.frame.length,
      ellipses: run.fixes.status.includes('applied')};
    image = null;
    if (run.ortho) {
      image = new Image();
      image.onload = redraw;
      image.src = jpeg(run.ortho.jpeg);
    }
    larger = enlargement();
    let html = '';
    for (const [name, said] of kLayers) {
      on[name] = on[name] === undefined ? true : on[name];
      if (there[name]) html += '<label><input type="checkbox" data-layer="' + name + '"' + (on[name] ? ' checked' : '') + '>' + swatch(name) + said + '</label>';
    }
    if (there.ellipses) html += '<label>corrections and uncertainties drawn <select id="larger">' + [1, 2, 5, 10, 20, 50].map((k) => '<option value="' + k + '"' + (k === larger ? ' selected' : '') + '>' +
      (k === 1 ? 'as they are' : k + ' times larger') + '</option>').join('') + '</select></label>';
    el('layers').innerHTML = html;
    el('layers').querySelectorAll('[data-layer]').forEach((c) => c.addEventListener('change', () => { on[c.dataset.layer] = c.checked; redraw(); }));
    if (el('larger')) el('larger').addEventListener('change', (e) => { larger = +e.target.value; redraw(); });
    cursor = fixAt = -1;
    tell(null);
    fit();
  }
  return {show, showFix, pointAt: (i) => { cursor = i; redraw(); }};
})();
)js"
                                R"js(
// ---- pictures ----------------------------------------------------------------------------------------------------
/// A picture of the left camera with things drawn over it.
const overPicture = (p, over) => '<svg viewBox="0 0 ' + (p.width || 4) + ' ' + (p.height || 3) + '" role="img" aria-label="Left image of frame ' + p.frame + '">' +
  (p.jpeg >= 0 ? '<image href="' + jpeg(p.jpeg) + '" width="' + p.width + '" height="' + p.height + '"/>' : '') + over + '</svg>';

/// Regions as paths: `fill` in strips, `edge` along the borders; in pixels of the image.
function regionPaths(r) {
  const labels = new Uint8Array(r.width * r.height);
  for (let i = 0, at = 0; i < r.runs.length; i += 2) { labels.fill(r.runs[i], at, at + r.runs[i + 1]); at += r.runs[i + 1]; }
  const regions = new Map();
  const of = (label) => { if (!regions.has(label)) regions.set(label, {fill: '', edge: '', pixels: 0}); return regions.get(label); };
  const d = r.divisor, get = (x, y) => (x < 0 || y < 0 || x >= r.width || y >= r.height ? 0 : labels[y * r.width + x]);
  for (let y = 0; y < r.height; ++y) for (let x = 0; x < r.width; ++x) {
    const label = get(x, y);
    if (!label) continue;
    const region = of(label);
    ++region.pixels;
    if (get(x - 1, y) !== label) {
      let end = x;
      while (get(end, y) === label) ++end;
      region.fill += 'M' + d * x + ' ' + d * y + 'h' + d * (end - x) + 'v' + d + 'h' + -d * (end - x) + 'z';
    }
    for (const side of [-1, 1]) {  // each straight piece of border once, from its left or upper end
      if (get(x, y + side) !== label && !(get(x - 1, y) === label && get(x - 1, y + side) !== label)) {
        let end = x;
        while (get(end, y) === label && get(end, y + side) !== label) ++end;
        region.edge += 'M' + d * x + ' ' + d * (side < 0 ? y : y + 1) + 'h' + d * (end - x);
      }
      if (get(x + side, y) !== label && !(get(x, y - 1) === label && get(x + side, y - 1) !== label)) {
        let end = y;
        while (get(x, end) === label && get(x + side, end) !== label) ++end;
        region.edge += 'M' + d * (side < 0 ? x : x + 1) + ' ' + d * y + 'v' + d * (end - y);
      }
    }
  }
  return regions;
}

function showRegions(p) {
  let over = '';
  if (p.regions && el('show-regions').checked) {
    const evident = new Set(p.points.filter((q) => q[5] > 0 && q[4] > 0).map((q) => q[4]));
    for (const [label, r] of regionPaths(p.regions)) {
      const boulder = evident.has(label), said = boulder ? 'stands above the ground: a boulder, or a part of one' : 'does not stand above the ground: sand, shadow, or too far to tell';
      over += '<g><title>Region ' + label + ', ' + r.pixels * p.regions.divisor ** 2 + ' pixels: ' + said + '</title><path d="' + r.fill + '" fill="' + colourOf(label) + '" fill-opacity="' + (boulder ? 0.45 : 0.22) + '"/>' +
        (boulder ? '<path d="' + r.edge + '" fill="none" stroke="#000" stroke-width="4" stroke-opacity="0.6"/>' : '') +
        '<path d="' + r.edge + '" fill="none" stroke="' + (boulder ? '#fff' : colourOf(label)) + '" stroke-width="' + (boulder ? 2.2 : 0.8) + '"/></g>';
    }
  }
  if (el('show-points').checked) over += p.points.map((q) => '<circle cx="' + q[0] + '" cy="' + q[1] + '" r="1.8" fill="' + (q[5] ? colourOf(q[5]) : '#bbb') + '" stroke="#000" stroke-width="0.5"/>').join('');
  el('regions').innerHTML = overPicture(p, over) + '<p class="small">Frame ' + p.frame + ': ' + (p.jpeg < 0 ? 'the image is missing.' : p.boulders.length + (p.boulders.length === 1 ? ' boulder.' : ' boulders.')) + '</p>';
}

function labelledPicture(p) {
  let over = '';
  const placed = [];  // where numbers stand: of two that would overlap, the larger boulder's
  for (const [label, , , size, count, seen] of [...p.boulders].sort((a, b) => b[4] - a[4])) {
    const own = p.points.filter((q) => q[5] === label);
    if (!own.length) continue;
    const u = Math.max(20, Math.min(p.width - 20, own.reduce((a, q) => a + q[0], 0) / own.length)), v = Math.max(20, own.reduce((a, q) => Math.min(a, q[1]), 1e9) - 6);
    over += '<g><title>Boulder ' + label + ': ' + count + ' points, ' + number(size, 2) + ' m wide, ' + (seen ? 'known from the frame before' : 'new in this frame') + '</title>' +
      own.map((q) => '<circle cx="' + q[0] + '" cy="' + q[1] + '" r="2.6" fill="' + colourOf(label) + '" stroke="#000" stroke-width="0.5"/>').join('');
    if (placed.every(([x, y]) => Math.abs(x - u) > 40 || Math.abs(y - v) > 18)) {
      placed.push([u, v]);
      over += '<text x="' + u.toFixed(0) + '" y="' + v.toFixed(0) + '" text-anchor="middle" font-size="19" font-weight="700" font-family="system-ui, Arial, sans-serif" fill="#fff" stroke="#000" stroke-width="4" paint-order="stroke">' + label + '</text>';
    }
    over += '</g>';
  }
  return '<figure>' + overPicture(p, over) + '<figcaption>frame ' + p.frame + '</figcaption></figure>';
}

function clusterPlan(p, name, colour) {
  const xs = p.points.map((q) => q[2]).concat(p.camera_m[0]), ys = p.points.map((q) => q[3]).concat(p.camera_m[1]);
  const low = (v) => v.reduce((a, b) => Math.min(a, b)), high = (v) => v.reduce((a, b) => Math.max(a, b));
  const span = Math.max(2, high(xs) - low(xs), high(ys) - low(ys)) + 0.6, x0 = (low(xs) + high(xs) - span) / 2, y1 = (low(ys) + high(ys) + span) / 2;
  const k = 400 / span, u = (x) => ((x - x0) * k).toFixed(1), v = (y) => ((y1 - y) * k).toFixed(1);
  let over = '<rect width="400" height="400" fill="#777"/>';
  if (run.ortho) {
    const [lx, ly] = run.ortho.low_m, [hx, hy] = run.ortho.high_m;
    over += '<image href="' + jpeg(run.ortho.jpeg) + '" x="' + u(lx) + '" y="' + v(hy) + '" width="' + (hx - lx) * k + '" height="' + (hy - ly) * k + '" preserveAspectRatio="none" opacity="0.8"/>';
  }
  const o = run.orbital;
  o.x_m.forEach((x, i) => {
    if (x < x0 || x > x0 + span || o.y_m[i] > y1 || o.y_m[i] < y1 - span) return;
    const r = Math.max(3, 0.5 * o.diameter_m[i] * k);
    over += '<g fill="none"><title>Boulder of the orbital map, ' + number(o.diameter_m[i], 2) + ' m wide</title><circle cx="' + u(x) + '" cy="' + v(o.y_m[i]) + '" r="' + r + '" stroke="#000" stroke-opacity="0.5" stroke-width="4"/><circle cx="' + u(x) + '" cy="' + v(o.y_m[i]) + '" r="' + r + '" stroke="#F0E442" stroke-width="2"/></g>';
  });
  over += p.points.map((q) => { const c = colour(q); return '<circle cx="' + u(q[2]) + '" cy="' + v(q[3]) + '" r="2.4" fill="' + (c ? colourOf(c) : '#bbb') + '" stroke="#000" stroke-width="0.6"/>'; }).join('');
  if (name === 'after') over += p.boulders.map(([label, x, y, size, count]) => {
    const circle = '<circle cx="' + u(x) + '" cy="' + v(y) + '" r="' + (size / 2 * k).toFixed(1) + '" fill="#fff" fill-opacity="0.01" stroke="';
    return '<g><title>Boulder ' + label + ': ' + count + ' points, ' + number(size, 2) + ' m wide</title>' + circle + '#000" stroke-width="3.5"/>' + circle + '#fff" stroke-width="1.8"/></g>';
  }).join('');
  const a = p.heading_rad, tip = (turn, r) => (p.camera_m[0] * k - x0 * k + r * Math.cos(a + turn)).toFixed(1) + ',' + ((y1 - p.camera_m[1]) * k - r * Math.sin(a + turn)).toFixed(1);
  over += '<polygon points="' + [tip(0, 14), tip(2.5, 10), tip(-2.5, 10)].join(' ') + '" fill="#0072B2" stroke="#fff" stroke-width="1.5"><title>The camera</title></polygon>';
  const metre = k >= 100 ? 0.5 : 1;
  over += '<rect x="8" y="366" width="' + (metre * k + 12) + '" height="28" fill="#fff" fill-opacity="0.8"/><path d="M14 386v4h' + metre * k + 'v-4" fill="none" stroke="#000" stroke-width="2"/><text x="' + (14 + metre * k / 2) + '" y="382" text-anchor="middle" font-size="13" font-family="system-ui, Arial, sans-serif">' + metre + ' m</text>';
  return '<figure><svg viewBox="0 0 400 400" role="img" aria-label="Points from above, ' + name + ' grouping">' + over + '</svg><figcaption>' + (name === 'after' ? 'after grouping: ' + p.boulders.length + (p.boulders.length === 1 ? ' boulder' : ' boulders') : 'before grouping, by region') + '</figcaption></figure>';
}

let strip = null;
function showStrip(i) {
  strip = run.strips[i];
  el('strip-buttons').querySelectorAll('button').forEach((b, k) => b.setAttribute('aria-pressed', String(k === i)));
  const last = strip[strip.length - 1];
  el('strip-words').textContent = 'The rover must know that a boulder of one frame is that of the next. 3D points of the last frame vote for the boulders of this one, from frame to frame. ' +
    (strip.length > 1 ? 'These frames are ' + run.stride + ' apart: ' : '') + 'the same number and colour is the same boulder, as the rover believes. A number goes where a boulder leaves the image or is missed once.';
  showRegions(last);
  el('labels').innerHTML = strip.map(labelledPicture).join('');
  el('clusters').innerHTML = clusterPlan(last, 'before', (q) => q[4]) + clusterPlan(last, 'after', (q) => q[5]);
}
function showStrips() {
  const any = run.strips.some((s) => s.length);
  el('strips').hidden = !any;
  el('no-strips').hidden = any;
  if (!any) return;
  const distance = (frame) => run.frames.distance_m[run.frames.frame.indexOf(frame)];
  el('strip-buttons').innerHTML = run.strips.map((s) => { const f = s[s.length - 1].frame; return '<button type="button">frame ' + f + ', ' + number(distance(f), 1) + ' m</button>'; }).join('');
  el('strip-buttons').querySelectorAll('button').forEach((b, i) => b.addEventListener('click', () => showStrip(i)));
  showStrip(0);
}
for (const id of ['show-regions', 'show-points']) el(id).addEventListener('change', () => { if (strip) showRegions(strip[strip.length - 1]); });

// ---- all of it ---------------------------------------------------------------------------------------------------
function choose(i) {
  run = data.runs[i];
  el('run').value = i;
  el('runs').querySelectorAll('tbody tr').forEach((r, k) => r.classList.toggle('chosen', data.runs.length > 1 && k === i));
  showLead();
  map.show();
  showCharts();
  showStrips();
  showFixes();
  showWork();
  showWorkCharts();
  const s = run.summary;
  el('origin').textContent = 'Run \u201c' + run.name + '\u201d: ' + s.frames + ' stereo pairs of ' + s.dataset + '; ' + (s.map ? 'map ' + s.map : 'no map') + '; VO ' + voWords(s) + '; mission ' + s.mission + ', variant ' + s.variant + '. Written by cairn report.';
}
el('run').innerHTML = data.runs.map((r, i) => '<option value="' + i + '">' + esc(r.name) + '</option>').join('');
el('run').addEventListener('change', (e) => choose(+e.target.value));
el('chooser').hidden = data.runs.length < 2;
showRuns();
showTogether();
choose(0);
})();
)js";

}  // namespace cairn::ground
