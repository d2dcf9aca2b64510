#include "profile/page.hpp"

namespace cairn::ground {

// Colours of the jobs are those of the report's lines (Okabe and Ito).
const char* const kProfileStyle = R"css(
:root { --job0: #0072B2; --job1: #D55E00; --job2: #007a59; --job3: #8a4f78; --other: #6a737d; }
@media (prefers-color-scheme: dark) { :root { --job0: #4aa8e0; --job1: #f08339; --job2: #2fc398; --job3: #CC79A7; --other: #8b949e; } }
.swatch { display: inline-block; width: 12px; height: 12px; border-radius: 3px; margin-right: 6px; vertical-align: -1px; }
.tools { display: flex; flex-wrap: wrap; gap: 8px 12px; align-items: center; margin: 8px 0; }
.tools .group { display: inline-flex; gap: 4px; }
.tools input { font: inherit; color: var(--ink); background: var(--back); border: 1px solid var(--line); border-radius: 6px; padding: 4px 10px; min-height: 36px; width: min(260px, 100%); }
.flame { position: relative; border: 1px solid var(--line); border-radius: 6px; overflow: hidden; background: var(--plate); }
.flame button { position: absolute; height: 21px; min-height: 0; padding: 0 4px; border: 0; border-radius: 2px; overflow: hidden; white-space: nowrap;
  text-overflow: clip; text-align: left; font-size: 12px; line-height: 21px; color: #fff; box-shadow: inset -1px -1px 0 var(--back); max-width: none; }
.flame button:focus-visible { outline: 3px solid var(--ink); outline-offset: -3px; z-index: 2; }
.flame button.faint { opacity: 0.25; }
@media (prefers-color-scheme: dark) { .flame button { color: #0b0d10; } }
.told { min-height: 4.6em; font-size: 0.9rem; padding: 6px 2px; font-variant-numeric: tabular-nums; }
.meter { display: inline-block; width: 120px; height: 12px; background: var(--plate); border: 1px solid var(--line); border-radius: 3px; overflow: hidden; vertical-align: -1px; position: relative; }
.meter i { position: absolute; left: 0; top: 0; bottom: 0; }
.meter i.over { background-image: repeating-linear-gradient(45deg, transparent 0 3px, rgb(255 255 255 / 55%) 3px 6px); }
#functions th button { background: none; border: 0; padding: 0; min-height: 24px; font-weight: 600; color: inherit; text-align: inherit; }
#functions td.words { max-width: 34em; overflow: hidden; text-overflow: ellipsis; }
.verdict { font-weight: 600; }
.tools label { display: inline-flex; gap: 6px; align-items: center; flex-wrap: wrap; }
@media (max-width: 600px) { #functions td.words, #functions th.words { max-width: 46vw; } }
)css";

const char* const kProfileBody = R"html(<header>
<h1>Cairn: what a frame costs on <span id="where"></span></h1>
<p id="lead" class="lead"></p>
<noscript><p class="note">This page draws its figures with its own script; please allow scripts for it. It loads nothing
from anywhere.</p></noscript>
</header>
<main>
<section>
<h2>Jobs against their budgets</h2>
<div class="scroll" tabindex="0" role="region" aria-label="Table of jobs"><table id="jobs"></table></div>
<p class="small">A round is one stereo pair, for registration one fix; a job's slices are added up. Seconds are model cycles at the clock
above. The model: one instruction a cycle, in order, operands waited for, first-level caches, memory as assumed
in <code>timing.toml</code>. It is no proof of the worst case; what it can and can't say is in <code>doc/BUDGETS.md</code>.</p>
<div class="charts" id="rounds"></div>
</section>
<section>
<h2>Where the cycles go</h2>
<p>Each bar is a function called from the one above it; its width is what it and all below it spend. Colours are jobs. Choose a bar
to make it the whole width; the topmost one leads back.</p>
<div class="tools">
<span class="group" role="group" aria-label="What is shown"><button type="button" data-span="all">all frames</button><button type="button" data-span="detail" id="detail-button"></button></span>
<span class="group" role="group" aria-label="Measure"><button type="button" data-measure="cycles">cycles</button><button type="button" data-measure="instructions">instructions</button></span>
<button type="button" id="up">one up</button>
<label>find <input id="find" type="search" placeholder="part of a name" autocomplete="off"></label>
</div>
<div class="layers" id="legend"></div>
<div class="flame" id="flame" role="group" aria-label="Flame graph"></div>
<div class="told" id="told" role="status" aria-live="polite"></div>
</section>
<section>
<h2>Functions</h2>
<div class="tools"><label>show <input id="filter" type="search" placeholder="part of a name" autocomplete="off"></label><button type="button" id="more"></button></div>
<div class="scroll" tabindex="0" role="region" aria-label="Table of functions"><table id="functions"></table></div>
<p class="small">&ldquo;Self&rdquo; is without what it calls, &ldquo;with calls&rdquo; is all below it, &ldquo;longest&rdquo; its most expensive
single call. What the compiler put into its caller counts there. &ldquo;Stalled&rdquo; are cycles that waited for memory.</p>
</section>
</main>
)html";

const char* const kProfileScript = R"js('use strict';
(() => {
const data = JSON.parse(document.getElementById('data').textContent);
const el = (id) => document.getElementById(id);
const esc = (text) => String(text).replace(/[&<>"']/g, (c) => ({'&': '&amp;', '<': '&lt;', '>': '&gt;', '"': '&quot;', "'": '&#39;'}[c]));
const fixed = (v, digits) => v.toFixed(digits).replace('-', '\u2212');
const millions = (v) => { const m = v / 1e6; return fixed(m, m >= 100 ? 1 : m >= 1 ? 2 : 4); };
const seconds = (cycles) => cycles / (1e6 * data.clock_mhz);
const colour = (job) => (job < 0 ? 'var(--other)' : 'var(--job' + job % 4 + ')');
const kRow = 22;

// ---- jobs --------------------------------------------------------------------------------------------------------
el('where').textContent = data.processor;
const broken = data.jobs.filter((j) => j.broken);
el('lead').textContent = data.frames + ' stereo pairs at ' + data.clock_mhz + ' MHz: ' + fixed(data.total[0] / 1e9, 2) + ' billion instructions, ' + fixed(data.total[1] / 1e9, 2) + ' billion model cycles. ' +
  (broken.length === 0 ? 'Every job keeps its budget.' : 'Over budget: ' + broken.map((j) => j.name).join(', ') + '.');
function showJobs() {
  let html = '<thead><tr><th class="words">job</th><th class="words">verdict</th><th>seconds<br>longest</th><th><br>mean</th><th>budget,<br>s</th><th>share of<br>budget</th><th class="words"></th><th>headroom,<br>s</th>' +
    '<th>longest in<br>frame</th><th>rounds</th><th>million instructions<br>longest</th><th><br>mean</th><th>million cycles<br>longest</th><th><br>mean</th></tr></thead><tbody>';
  data.jobs.forEach((j, i) => {
    const s = seconds(j.longest[1]), share = s / j.budget_s;
    const td = (list) => list.map((c) => '<td>' + c + '</td>').join('');
    html += '<tr><td class="words"><span class="swatch" style="background:' + colour(i) + '"></span>' + esc(j.name) + '</td><td class="words verdict ' + (j.broken ? 'worse">\u2716 broken' : 'better">\u2714 holds') + '</td>' +
      (j.rounds.length === 0 ? '<td colspan="12" class="words">never ran</td>' :
        td([fixed(s, 3), fixed(seconds(j.mean[1]), 3), fixed(j.budget_s, 3), fixed(100 * share, 0) + ' %']) +
        '<td class="words"><span class="meter"><i class="' + (share > 1 ? 'over' : '') + '" style="width:' + Math.min(100, 100 * share).toFixed(1) + '%;background-color:' + colour(i) + '"></i></span></td>' +
        td([fixed(j.budget_s - s, 3), j.longest_frame, j.rounds.length, millions(j.longest[0]), millions(j.mean[0]), millions(j.longest[1]), millions(j.mean[1])])) + '</tr>';
  });
  el('jobs').innerHTML = html + '</tbody>';
}
function showRounds() {
  el('rounds').innerHTML = data.jobs.filter((j) => j.rounds.length > 1).map((j) => {
    const w = 560, h = 150, left = 44, bottom = 22, top = Math.max(j.budget_s, ...j.rounds.map((r) => r[1])) * 1.08;
    const last = Math.max(...j.rounds.map((r) => r[0])) + 1, step = (w - left) / last;
    const y = (s) => (h - bottom) * (1 - s / top) + 4;
    const bars = j.rounds.map((r) => '<rect x="' + (left + r[0] * step).toFixed(1) + '" width="' + Math.max(0.6, step - 1.5).toFixed(1) + '" y="' + y(r[1]).toFixed(1) + '" height="' + (y(0) - y(r[1])).toFixed(1) +
      '" fill="' + colour(data.jobs.indexOf(j)) + '"><title>frame ' + r[0] + ': ' + fixed(r[1], 3) + ' s</title></rect>').join('');
    return '<figure class="chart"><figcaption>' + esc(j.name) + ', seconds a round (dashed: budget)</figcaption><svg viewBox="0 0 ' + w + ' ' + h + '" role="img" aria-label="' + esc(j.name) + ': seconds of each round, budget ' + j.budget_s + ' s">' + bars +
      '<line x1="' + left + '" x2="' + w + '" y1="' + y(j.budget_s) + '" y2="' + y(j.budget_s) + '" stroke="var(--ink)" stroke-width="1.5" stroke-dasharray="6 4"/>' +
      '<text x="' + (left - 6) + '" y="' + (y(j.budget_s) + 4) + '" text-anchor="end">' + j.budget_s + '</text><text x="' + (left - 6) + '" y="' + (y(0) + 4) + '" text-anchor="end">0</text>' +
      '<line x1="' + left + '" x2="' + w + '" y1="' + y(0) + '" y2="' + y(0) + '" class="grid"/><text x="' + left + '" y="' + (h - 2) + '">frame 0</text><text x="' + w + '" y="' + (h - 2) + '" text-anchor="end">' + (last - 1) + '</text></svg></figure>';
  }).join('');
}

// ---- flame graph -------------------------------------------------------------------------------------------------
const nodes = data.nodes.map(([parent, fn, job, calls, insn, cycles, dcalls, dinsn, dcycles], i) => ({i, parent, job, name: data.functions[fn][0], children: [],
  calls: {all: calls, detail: dcalls}, self: {all: {instructions: insn, cycles}, detail: {instructions: dinsn, cycles: dcycles}}, sum: {all: {}, detail: {}}}));
nodes[0].name = 'everything';
for (const n of nodes) if (n.i > 0) nodes[n.parent].children.push(n);
for (const span of ['all', 'detail']) for (const m of ['instructions', 'cycles']) {
  for (const n of nodes) n.sum[span][m] = n.self[span][m];
  for (let i = nodes.length - 1; i > 0; --i) nodes[nodes[i].parent].sum[span][m] += nodes[i].sum[span][m];
}
let span = 'all', measure = 'cycles', focus = nodes[0], wanted = '';
const value = (n) => n.sum[span][measure];
const path = (n) => { const out = [n]; while (out[0].i !== 0) out.unshift(nodes[out[0].parent]); return out; };
function tell(n) {
  const whole = value(nodes[0]) || 1, c = n.sum[span].cycles, calls = n.calls[span];
  el('told').innerHTML = '<b>' + esc(n.name) + '</b>' + (n.job >= 0 ? ' \u2013 ' + esc(data.jobs[n.job].name) : '') + '<br>' + fixed(100 * value(n) / whole, 2) + ' % of ' + measure + ': ' + millions(c) + ' million cycles (' +
    fixed(seconds(c), 4) + ' s), of them ' + millions(n.self[span].cycles) + ' its own; ' + millions(n.sum[span].instructions) + ' million instructions' +
    (n.i > 0 ? '; ' + calls.toLocaleString('en') + (calls === 1 ? ' call' : ' calls') : '') + '<br><span class="small">' + path(n).map((p) => esc(p.name)).join(' \u203a ') + '</span>';
}
function draw() {
  const box = el('flame'), whole = value(focus), width = box.clientWidth || 1, least = 1.5 / width;
  const parts = [];
  let deepest = 0;
  const bar = (n, x, w, row, faint) => {
    deepest = Math.max(deepest, row);
    const found = wanted && n.name.toLowerCase().includes(wanted);
    parts.push('<button type="button" data-node="' + n.i + '" class="' + (faint || (wanted && !found) ? 'faint' : '') + '" style="left:' + (100 * x).toFixed(3) + '%;width:' + (100 * w).toFixed(3) + '%;top:' + row * kRow + 'px;background:' + colour(n.job) +
      ';filter:brightness(' + (0.88 + 0.06 * (n.i % 4)).toFixed(2) + ')" aria-label="' + esc(n.name) + ', ' + fixed(100 * value(n) / (value(nodes[0]) || 1), 1) + ' percent">' + (w * width > 22 ? esc(n.name) : '') + '</button>');
  };
  const above = path(focus).slice(0, -1);
  above.forEach((n, row) => bar(n, 0, 1, row, true));
  const place = (n, x, row) => {
    const w = value(n) / whole;
    if (!(w > least)) return;
    bar(n, x, w, row, false);
    let at = x;
    for (const c of [...n.children].sort((a, b) => value(b) - value(a))) { place(c, at, row + 1); at += value(c) / whole; }
  };
  if (whole > 0) place(focus, 0, above.length);
  box.innerHTML = parts.join('');
  box.style.height = (deepest + 1) * kRow + 'px';
  document.querySelectorAll('[data-span]').forEach((b) => b.setAttribute('aria-pressed', String(b.dataset.span === span)));
  document.querySelectorAll('[data-measure]').forEach((b) => b.setAttribute('aria-pressed', String(b.dataset.measure === measure)));
  el('up').disabled = focus.i === 0;
}
function look(n, keep) {
  focus = n;
  draw();
  tell(n);
  if (keep) el('flame').querySelector('[data-node="' + n.i + '"]').focus({preventScroll: true});
}
el('flame').addEventListener('click', (e) => { const b = e.target.closest('[data-node]'); if (b) look(nodes[+b.dataset.node], true); });
for (const event of ['pointerover', 'focusin']) el('flame').addEventListener(event, (e) => { const b = e.target.closest('[data-node]'); if (b) tell(nodes[+b.dataset.node]); });
el('up').addEventListener('click', () => look(nodes[focus.parent]));
el('find').addEventListener('input', (e) => { wanted = e.target.value.trim().toLowerCase(); draw(); });
document.querySelectorAll('[data-span]').forEach((b) => b.addEventListener('click', () => { span = b.dataset.span; look(value(focus) > 0 ? focus : nodes[0]); }));
document.querySelectorAll('[data-measure]').forEach((b) => b.addEventListener('click', () => { measure = b.dataset.measure; look(focus); }));
el('detail-button').textContent = 'frame ' + data.detail_frame + ' alone';
el('detail-button').hidden = data.detail_frame < 0;
el('legend').innerHTML = data.jobs.map((j, i) => '<span><span class="swatch" style="background:' + colour(i) + '"></span>' + esc(j.name) + '</span>').join('') +
  '<span><span class="swatch" style="background:var(--other)"></span>around them</span>';
new ResizeObserver(() => draw()).observe(el('flame'));

// ---- functions ---------------------------------------------------------------------------------------------------
const kColumns = [['function', 0], ['calls', 1], ['self,<br>M instr.', 2], ['self,<br>M cycles', 3], ['self,<br>%', 'share'], ['cycles an<br>instr.', 'cpi'], ['with calls,<br>M cycles', 4], ['longest,<br>M cycles', 5],
  ['data<br>misses', 6], ['fetch<br>misses', 7], ['stalled,<br>M cycles', 8], ['frame ' + data.detail_frame + ',<br>M cycles', 10]];
let order = 3, falling = true, all = false;
const cell = (f, key) => (key === 'share' ? 100 * f[3] / data.total[1] : key === 'cpi' ? (f[2] ? f[3] / f[2] : 0) : f[key]);
function showFunctions() {
  const part = el('filter').value.trim().toLowerCase();
  const rows = data.functions.filter((f) => f[3] > 0 && f[0].toLowerCase().includes(part))
    .sort((a, b) => { const x = cell(a, order), y = cell(b, order), d = typeof x === 'string' ? x.localeCompare(y) : x - y; return falling ? -d : d; });
  const shown = all ? rows : rows.slice(0, 50);
  const form = (f, key) => (key === 0 ? esc(f[0]) : key === 'share' || key === 'cpi' ? fixed(cell(f, key), 2) : key === 1 || key === 6 || key === 7 ? f[key].toLocaleString('en') : millions(f[key]));
  const columns = kColumns.filter((c) => c[1] !== 10 || data.detail_frame >= 0);
  el('functions').innerHTML = '<thead><tr>' + columns.map(([head, key]) => '<th class="' + (key === 0 ? 'words' : '') + '" aria-sort="' + (key === order ? (falling ? 'descending' : 'ascending') : 'none') + '"><button type="button" data-sort="' + key + '">' + head +
    (key === order ? (falling ? ' \u25be' : ' \u25b4') : '') + '</button></th>').join('') + '</tr></thead><tbody>' +
    shown.map((f) => '<tr>' + columns.map(([, key]) => '<td' + (key === 0 ? ' class="words"' : '') + '>' + form(f, key) + '</td>').join('') + '</tr>').join('') + '</tbody>';
  el('more').textContent = all ? 'the first 50 only' : 'all ' + rows.length;
  el('more').hidden = rows.length <= 50;
}
el('functions').addEventListener('click', (e) => {
  const b = e.target.closest('[data-sort]');
  if (!b) return;
  const key = /^\d+$/.test(b.dataset.sort) ? +b.dataset.sort : b.dataset.sort;
  falling = key === order ? !falling : key !== 0;
  order = key;
  showFunctions();
  el('functions').querySelector('[data-sort="' + key + '"]').focus();
});
el('filter').addEventListener('input', showFunctions);
el('more').addEventListener('click', () => { all = !all; showFunctions(); });

showJobs();
showRounds();
look(nodes[0]);
showFunctions();
})();
)js";

}  // namespace cairn::ground
