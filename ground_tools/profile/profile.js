'use strict';
// What a frame costs: jobs against their budgets, a flame graph of the calling contexts, all functions.

/* global Page */
(() => {
  const {data, el, esc, number, tag, words, row, table, jobArea} = Page;

  const count = (n) => n.toLocaleString('en');
  const millions = (v) => {
    const m = v / 1e6;
    return number(m, m >= 100 ? 1 : m >= 1 ? 2 : 4);
  };
  const seconds = (cycles) => cycles / (1e6 * data.clock_mhz);
  const colour = (job) => (job < 0 ? 'var(--hue-other)' : jobArea(data.jobs[job].name));
  const swatch = (job) => tag('span', {class: 'swatch', style: `background:${colour(job)}`});

  // ---- jobs ----
  function showLead() {
    const broken = data.jobs.filter((j) => j.broken).map((j) => j.name);
    el('where').textContent = data.processor;
    el('lead').textContent = `${data.frames} stereo pairs at ${data.clock_mhz} MHz: ` +
        `${number(data.total[0] / 1e9, 2)} billion instructions, ` +
        `${number(data.total[1] / 1e9, 2)} billion model cycles. ` +
        (broken.length === 0 ? 'Every job keeps its budget.' : `Over budget: ${broken.join(', ')}.`);
  }

  function jobRow(j, i) {
    const name = words(swatch(i) + esc(j.name));
    const verdict =
        j.broken ? words('\u2716 broken', 'verdict worse') : words('\u2714 holds', 'verdict better');
    if (j.rounds.length === 0) return row([name, verdict, {text: 'never ran', class: 'words', colspan: 12}]);
    const longest = seconds(j.longest[1]), share = longest / j.budget_s;
    const width = Math.min(100, 100 * share).toFixed(1);
    const style = `width:${width}%;background-color:${colour(i)}`;
    const meter = tag('span', {class: 'meter'}, tag('i', {class: share > 1 ? 'over' : '', style}));
    return row([
      name, verdict, number(longest, 3), number(seconds(j.mean[1]), 3), number(j.budget_s, 3),
      `${number(100 * share, 0)} %`, words(meter), number(j.budget_s - longest, 3), j.longest_frame,
      j.rounds.length, millions(j.longest[0]), millions(j.mean[0]), millions(j.longest[1]),
      millions(j.mean[1])
    ]);
  }

  function showJobs() {
    el('jobs').innerHTML = table(
        [
          words('job'), words('verdict'), 'seconds<br>longest', '<br>mean', 'budget,<br>s',
          'share of<br>budget', '', 'headroom,<br>s', 'longest in<br>frame', 'rounds',
          'million instructions<br>longest', '<br>mean', 'million cycles<br>longest', '<br>mean'
        ],
        data.jobs.map(jobRow));
  }

  /// Seconds of each round as bars over the frames, and the budget as a line.
  function roundsChart(j) {
    const width = 560, height = 150, left = 44, bottom = 22;
    const top = 1.08 * Math.max(j.budget_s, ...j.rounds.map(([, s]) => s));
    const last = Math.max(...j.rounds.map(([frame]) => frame)) + 1, step = (width - left) / last;
    const y = (s) => (height - bottom) * (1 - s / top) + 4;
    const level = (s, as) => tag('line', {x1: left, x2: width, y1: y(s), y2: y(s), class: as});
    const label = (x, at, text, anchor) => tag('text', {x, y: at, 'text-anchor': anchor}, text);
    const bars = j.rounds.map(
        ([frame, s]) =>
            tag('rect', {
              x: left + frame * step,
              y: y(s),
              width: Math.max(0.6, step - 1.5),
              height: y(0) - y(s),
              fill: jobArea(j.name)
            },
                tag('title', {}, `frame ${frame}: ${number(s, 3)} s`)));
    const values = [j.budget_s, 0].map((s) => label(left - 6, y(s) + 4, s, 'end')).join('');
    const frames = label(left, height - 2, 'frame 0', 'start') + label(width, height - 2, last - 1, 'end');
    const axes = level(j.budget_s, 'budget') + level(0, 'grid') + values + frames;
    const said = `${j.name}: seconds of each round, budget ${j.budget_s} s`;
    const svg = tag(
        'svg', {viewBox: `0 0 ${width} ${height}`, role: 'img', 'aria-label': said}, bars.join('') + axes);
    const caption = tag('figcaption', {}, `${esc(j.name)}, seconds a round (dashed: budget)`);
    return tag('figure', {class: 'chart'}, caption + svg);
  }

  // ---- flame graph ----
  const kRow_px = 22;
  const nodes = data.nodes.map(
      ([parent, fn, job, calls, insn, cycles, dcalls, dinsn, dcycles], i) => ({
        i,
        parent,
        job,
        name: i === 0 ? 'everything' : data.functions[fn][0],
        children: [],
        calls: {all: calls, detail: dcalls},
        self: {all: {instructions: insn, cycles}, detail: {instructions: dinsn, cycles: dcycles}},
        sum: {all: {instructions: insn, cycles}, detail: {instructions: dinsn, cycles: dcycles}},
      }));
  for (const n of nodes.slice(1)) nodes[n.parent].children.push(n);
  for (const n of nodes.slice(1).reverse()) {  // children before their parents
    for (const of of ['all', 'detail']) {
      for (const what of ['instructions', 'cycles']) nodes[n.parent].sum[of][what] += n.sum[of][what];
    }
  }

  let span = 'all', measure = 'cycles', focus = nodes[0], wanted = '';
  const value = (n) => n.sum[span][measure];
  const path = (n) => (n.i === 0 ? [n] : [...path(nodes[n.parent]), n]);

  function tell(n) {
    const cycles = n.sum[span].cycles, calls = n.calls[span];
    const share = number(100 * value(n) / (value(nodes[0]) || 1), 2);
    el('told').innerHTML = tag('b', {}, esc(n.name)) +
        (n.job >= 0 ? ` \u2013 ${esc(data.jobs[n.job].name)}` : '') +
        `<br>${share} % of ${measure}: ${millions(cycles)} million cycles (${
                               number(seconds(cycles), 4)} s), ` +
        `of them ${millions(n.self[span].cycles)} its own; ` +
        `${millions(n.sum[span].instructions)} million instructions` +
        (n.i > 0 ? `; ${count(calls)} ${calls === 1 ? 'call' : 'calls'}` : '') + '<br>' +
        tag('span', {class: 'small'}, path(n).map((p) => esc(p.name)).join(' \u203a '));
  }

  /// One bar: from x, w wide, both as shares of the whole width.
  function bar(n, x, w, line, faint, width_px) {
    const found = wanted && n.name.toLowerCase().includes(wanted);
    const place = `left:${(100 * x).toFixed(3)}%;width:${(100 * w).toFixed(3)}%;top:${line * kRow_px}px`;
    const shade = `background:${colour(n.job)};filter:brightness(${(0.88 + 0.06 * (n.i % 4)).toFixed(2)})`;
    return tag(
        'button', {
          type: 'button',
          'data-node': n.i,
          class: faint || (wanted && !found) ? 'faint' : '',
          style: `${place};${shade}`,
          'aria-label': `${n.name}, ${number(100 * value(n) / (value(nodes[0]) || 1), 1)} percent`
        },
        w * width_px > 22 ? esc(n.name) : '');
  }

  function draw() {
    const box = el('flame'), whole = value(focus), width = box.clientWidth || 1;
    const above = path(focus).slice(0, -1);
    const bars = above.map((n, line) => bar(n, 0, 1, line, true, width));
    let deepest = above.length;
    const place = (n, x, line) => {
      const w = value(n) / whole;
      if (!(w * width > 1.5)) return;
      deepest = Math.max(deepest, line);
      bars.push(bar(n, x, w, line, false, width));
      let at = x;
      for (const c of [...n.children].sort((a, b) => value(b) - value(a))) {
        place(c, at, line + 1);
        at += value(c) / whole;
      }
    };
    if (whole > 0) place(focus, 0, above.length);
    box.innerHTML = bars.join('');
    box.style.height = `${(deepest + 1) * kRow_px}px`;
    const press = (b, on) => b.setAttribute('aria-pressed', String(on));
    document.querySelectorAll('[data-span]').forEach((b) => press(b, b.dataset.span === span));
    document.querySelectorAll('[data-measure]').forEach((b) => press(b, b.dataset.measure === measure));
    el('up').disabled = focus.i === 0;
  }

  function look(n) {
    focus = n;
    draw();
    tell(n);
  }

  function startFlame() {
    const flame = el('flame');
    const nodeOf = (e) => {
      const b = e.target.closest('[data-node]');
      return b && nodes[+b.dataset.node];
    };
    flame.addEventListener('click', (e) => {
      const n = nodeOf(e);
      if (!n) return;
      look(n);
      flame.querySelector(`[data-node="${n.i}"]`).focus({preventScroll: true});
    });
    for (const event of ['pointerover', 'focusin']) {
      flame.addEventListener(event, (e) => {
        const n = nodeOf(e);
        if (n) tell(n);
      });
    }
    el('up').addEventListener('click', () => look(nodes[focus.parent]));
    el('find').addEventListener('input', (e) => {
      wanted = e.target.value.trim().toLowerCase();
      draw();
    });
    document.querySelectorAll('[data-span]').forEach((b) => b.addEventListener('click', () => {
      span = b.dataset.span;
      look(value(focus) > 0 ? focus : nodes[0]);
    }));
    document.querySelectorAll('[data-measure]').forEach((b) => b.addEventListener('click', () => {
      measure = b.dataset.measure;
      look(focus);
    }));
    el('detail-button').textContent = `frame ${data.detail_frame} alone`;
    el('detail-button').hidden = data.detail_frame < 0;
    const entry = (job, name) => tag('span', {}, swatch(job) + esc(name));
    el('legend').innerHTML = data.jobs.map((j, i) => entry(i, j.name)).join('') + entry(-1, 'around them');
    new ResizeObserver(draw).observe(flame);
    look(nodes[0]);
  }

  // ---- functions ----
  // Each: name, heading, what it is sorted by, how it is written.
  const kColumns = [
    ['name', 'function', (f) => f[0], esc],
    ['calls', 'calls', (f) => f[1], count],
    ['instructions', 'self,<br>M instr.', (f) => f[2], millions],
    ['cycles', 'self,<br>M cycles', (f) => f[3], millions],
    ['share', 'self,<br>%', (f) => 100 * f[3] / data.total[1], (v) => number(v, 2)],
    ['cpi', 'cycles an<br>instr.', (f) => (f[2] ? f[3] / f[2] : 0), (v) => number(v, 2)],
    ['inclusive', 'with calls,<br>M cycles', (f) => f[4], millions],
    ['longest', 'longest,<br>M cycles', (f) => f[5], millions],
    ['data', 'data<br>misses', (f) => f[6], count],
    ['fetch', 'fetch<br>misses', (f) => f[7], count],
    ['stalled', 'stalled,<br>M cycles', (f) => f[8], millions],
    ['detail', `frame ${data.detail_frame},<br>M cycles`, (f) => f[10], millions],
  ].filter(([key]) => key !== 'detail' || data.detail_frame >= 0);
  const kFirst = 50;
  let order = 'cycles', falling = true, all = false;

  function heading([key, text]) {
    const chosen = key === order;
    const mark = chosen ? (falling ? ' \u25be' : ' \u25b4') : '';
    return {
      text: tag('button', {type: 'button', 'data-sort': key}, text + mark),
      class: key === 'name' ? 'words' : '',
      'aria-sort': chosen ? (falling ? 'descending' : 'ascending') : 'none'
    };
  }

  function showFunctions() {
    const part = el('filter').value.trim().toLowerCase();
    const sorted = kColumns.find(([key]) => key === order)[2];
    const compare = (a, b) => (typeof a === 'string' ? a.localeCompare(b) : a - b);
    const rows = data.functions.filter((f) => f[3] > 0 && f[0].toLowerCase().includes(part))
                     .sort((a, b) => (falling ? -1 : 1) * compare(sorted(a), sorted(b)));
    const cells = (f) => kColumns.map(([key, , get, form]) => {
      const text = form(get(f));
      return key === 'name' ? words(text) : text;
    });
    const shown = all ? rows : rows.slice(0, kFirst);
    el('functions').innerHTML = table(kColumns.map(heading), shown.map((f) => row(cells(f))));
    el('more').textContent = all ? `the first ${kFirst} only` : `all ${rows.length}`;
    el('more').hidden = rows.length <= kFirst;
  }

  function startFunctions() {
    el('functions').addEventListener('click', (e) => {
      const b = e.target.closest('[data-sort]');
      if (!b) return;
      const key = b.dataset.sort;
      falling = key === order ? !falling : key !== 'name';
      order = key;
      showFunctions();
      el('functions').querySelector(`[data-sort="${key}"]`).focus();
    });
    el('filter').addEventListener('input', showFunctions);
    el('more').addEventListener('click', () => {
      all = !all;
      showFunctions();
    });
    showFunctions();
  }

  showLead();
  showJobs();
  el('rounds').innerHTML = data.jobs.filter((j) => j.rounds.length > 1).map(roundsChart).join('');
  startFlame();
  startFunctions();
})();
