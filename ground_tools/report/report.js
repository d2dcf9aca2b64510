'use strict';
// The report: tables, charts, and which run is shown.

/* global Chart, DriveMap, Page, Pictures, Run */
(() => {
  const {data, el, esc, number, tag, words, row, table, jobLine} = Page;
  const link = (attributes, text) => tag('button', {type: 'button', class: 'link', ...attributes}, text);
  const onEach = (box, selector, act) =>
      el(box).querySelectorAll(selector).forEach((b) => b.addEventListener('click', () => act(b)));

  // ---- tables ----
  const kResults = [
    ['end_xy_m', 'end,<br>x y', 3], ['largest_xy_m', 'largest,<br>x y', 3], ['end_3d_m', 'end,<br>3D', 3],
    ['end_yaw_deg', 'end,<br>yaw', 2], ['end_rotation_deg', 'end,<br>rotation', 2]
  ];

  const anyTruth = data.runs.some((r) => r.errors);

  function showRuns() {
    const withTruth = (cells) => (anyTruth ? cells : []);
    const results = (part) => kResults.map(([key, , digits]) => number(part && part[key], digits));
    const heads = kResults.map(([, text]) => text);
    const tall = (text, as) => ({text, class: as, rowspan: 2});
    const wide = (text, columns) => ({text, class: 'group', colspan: columns});
    const one = (r, i) => {
      const s = r.summary, used = Run.used(r);
      const vo = Run.voWords(s) + (s.variant === 'paper' ? ', the paper\u2019s variant' : '');
      return row([
        words(data.runs.length > 1 ? link({'data-run': i}, esc(r.name)) : esc(r.name)),
        words(esc(Run.mapWords(s)), 'wrap'), words(esc(vo), 'wrap'),
        ...withTruth([number(s.path_m, 1), ...results(s.vo), ...results(s.corrected)]), used,
        r.fixes.status.length - used, r.ground.id.length
      ]);
    };
    el('runs').innerHTML = table(
        [
          [
            tall('run', 'words'), tall('map', 'words'), tall('VO', 'words'),
            ...withTruth([tall('driven,<br>m'), wide('VO alone', 5), wide('corrected', 5)]), wide('fixes', 2),
            tall('boulders<br>found')
          ],
          [...withTruth([...heads, ...heads]), 'used', 'not']
        ],
        data.runs.map(one));
    onEach('runs', '[data-run]', (b) => choose(+b.dataset.run));
  }

  function fixRow(run, i) {
    const f = run.fixes, frame = f.frame[i], used = Run.isUsed(run, i);
    const pair = (a, b) => `${number(a, 3)}, ${number(b, 3)}`;
    const change = f.before_m[i] !== null && used ? f.after_m[i] - f.before_m[i] : null;
    const judged = () => {
      if (change === null) return '';
      if (Math.abs(change) <= 0.0005) return 'same';
      return change < 0 ? tag('span', {class: 'better'}, '\u25bc better') :
                          tag('span', {class: 'worse'}, '\u25b2 worse');
    };
    return row([
      link({'data-fix': i, 'aria-label': `Show the fix of frame ${frame} on the map`}, frame),
      number(f.distance_m[i], 1),
      words(esc(Run.verdict(f.status[i]) + (f.lost[i] ? '; looked for in the whole map' : '')), 'wrap'),
      f.pairs[i], f.trimmed[i], f.gated[i], number(f.rms_m[i], 3), pair(f.sigma_x_m[i], f.sigma_y_m[i]),
      number(f.log_ratio[i], 1), f.second_log_ratio[i] > -1000 ? number(f.second_log_ratio[i], 1) : '\u2013',
      used ? pair(f.dx_m[i], f.dy_m[i]) : '\u2013', used ? number(f.dyaw_deg[i], 2) : '\u2013',
      ...(run.errors ? [number(f.before_m[i], 3), number(f.after_m[i], 3), words(judged())] : [])
    ]);
  }

  function showFixes(run) {
    if (run.fixes.frame.length === 0) {
      el('fixes').innerHTML = table([], [row([words('This run tried no fix.')])]);
      return;
    }
    el('fixes').innerHTML = table(
        [
          'frame', 'driven,<br>m', words('verdict'), 'pairs', 'rejected<br>as worst', 'without<br>partner',
          'remains,<br>m', 'sigma<br>x, y, m', 'evidence,<br>nats', 'second<br>best', 'moved by<br>x, y, m',
          'turned,<br>degrees', ...(run.errors ? ['error<br>before, m', 'error<br>after, m', ''] : [])
        ],
        run.fixes.frame.map((frame, i) => fixRow(run, i)));
    onEach('fixes', '[data-fix]', (b) => {
      DriveMap.showFix(+b.dataset.fix);
      el('mapbox').scrollIntoView({block: 'center'});
      el('map').focus({preventScroll: true});
    });
  }

  function median(values) {
    const sorted = [...values].sort((a, b) => a - b);
    return sorted.length ? sorted[sorted.length >> 1] : 0;
  }
  const most = (values) => values.reduce((a, b) => Math.max(a, b), 0);
  const sum = (values) => values.reduce((a, b) => a + b, 0);

  function showWork(run) {
    const f = run.frames, whole = sum(f.ms) || 1;
    const job = (name, ops, ms) => {
      const ran = ops.map((v, i) => i).filter((i) => ops[i] > 0), of = (list) => ran.map((i) => list[i]);
      return row([
        words(name), ran.length, number(median(of(ops)) / 1e6, 3), number(most(of(ops)) / 1e6, 3),
        number(median(of(ms)), 2), number(most(of(ms)), 2), `${number(100 * sum(ms) / whole, 1)} %`
      ]);
    };
    el('work').innerHTML = table(
        [
          words('job'), 'frames', 'million operations<br>median', '<br>most', 'milliseconds<br>median',
          '<br>longest', 'share of<br>the time'
        ],
        [
          job('visual odometry', f.vo_ops, f.vo_ms),
          job('boulders: segmentation, 3D points, labels', f.boulder_ops, f.boulder_ms),
          job('registration, where it ran', f.fix_ops, f.fix_ms), row([
            words('whole frame'), f.ms.length, '\u2013', '\u2013', number(median(f.ms), 2),
            number(most(f.ms), 2), '100 %'
          ])
        ]);
  }

  function showMemory(run) {
    const memory = Object.entries(run.summary.memory_bytes),
          largest = most(memory.map(([, bytes]) => bytes)) || 1;
    const bar = (bytes) => tag('span', {class: 'bar', style: `width:${(80 * bytes / largest).toFixed(0)}px`});
    const one = ([name, bytes]) =>
        row([words(esc(name).replace(/^ +/, '&emsp;')), number(bytes / 1024, 0), words(bar(bytes))]);
    el('memory').innerHTML = table([words('part'), 'KiB', ''], memory.map(one));
  }

  function showCounts(run) {
    const counts = run.summary.counts, rows = [];
    const add = (name, what, times) => rows.push(row([words(name), words(esc(what), 'wrap'), times]));
    const kinds =
        {'visual odometry': 'vo', 'boulders': 'boulders', 'fixes': 'fixes', 'over budget': 'overruns'};
    for (const [name, kind] of Object.entries(kinds)) {
      for (const [status, times] of Object.entries(counts[kind])) add(name, Run.status(kind, status), times);
    }
    const trust = run.frames.trust;
    for (const state of new Set(trust)) {
      add('trust in the pose', Run.status('trust', state), trust.filter((t) => t === state).length);
    }
    for (const [name, times] of Object.entries(counts)) {
      if (typeof times === 'number' && times > 0) add('other', name.replace(/_/g, ' '), times);
    }
    el('counts').innerHTML = table([words('job'), words('what became of it'), 'times'], rows);
  }

  // ---- charts ----
  const kDriven = 'distance driven, m';
  const kErrors = [
    ['xy_m', 'Position error in x and y, m'], ['xyz_m', 'Position error in 3D, m'],
    ['yaw_deg', 'Heading (yaw) error, degrees'], ['rotation_deg', 'Whole rotation error, degrees']
  ];

  const kNoPlace_m = 1000;  // sigma from which on a pose stands for no place: one that is lost has 10 km

  /// What the flight module says of its own pose: all that there is without truth.
  function showClaims(run) {
    const box = el('claim-charts'), f = run.frames;
    box.innerHTML = '';
    if (run.errors || !f.frame.length) return;
    const marks = run.fixes.distance_m.filter((d, i) => Run.isUsed(run, i));
    for (const [key, title] of [
             ['sigma_xy_m', 'Position in x and y: 3 sigma, m'],
             ['sigma_yaw_deg', 'Heading (yaw): 3 sigma, degrees']]) {
      const series = [{name: '3 sigma', colour: 'var(--corrected)', y: f[key].map((v) => 3 * v)}];
      const spans = Run.trustSpans(run);
      const limit = most(series[0].y.filter((v, i) => f.sigma_xy_m[i] < kNoPlace_m));
      Chart.draw(
          box, {title, digits: 3, x: f.distance_m, xName: kDriven, marks, series, limit, spans},
          DriveMap.pointAt);
    }
  }

  function showErrors(run) {
    const box = el('charts');
    box.innerHTML = '';
    if (!run.errors) return;
    const marks = run.fixes.distance_m.filter((d, i) => Run.isUsed(run, i)), f = run.frames;
    const claims = {
      xy_m: {name: '3 sigma, as claimed', x: f.distance_m, y: f.sigma_xy_m.map((v) => 3 * v)},
      yaw_deg:
          {name: '3 sigma, as claimed', x: f.distance_m, y: f.sigma_yaw_deg.map((v) => 3 * v), both: true}
    };
    const pick = run.errors.distance_m.length === run.frames.frame.length ? DriveMap.pointAt : null;
    for (const [key, title] of kErrors) {
      const series = [
        {name: 'VO alone', colour: 'var(--vo)', dash: '8 4', y: run.errors.vo[key]},
        {name: 'corrected', colour: 'var(--corrected)', y: run.errors.corrected[key]}
      ];
      Chart.draw(
          box, {
            title,
            digits: 3,
            x: run.errors.distance_m,
            xName: kDriven,
            marks,
            series,
            band: claims[key],
            spans: Run.trustSpans(run)
          },
          pick);
    }
  }

  /// Each run's corrected path: runs have no colours of their own.
  function showTogether() {
    const told = data.runs.filter((r) => r.errors);
    if (told.length < 2) return;
    el('together').hidden = false;
    const colours = ['corrected', 'vo', 'good', 'fix', 'ink', 'seen', 'dim'], dashes = ['', '8 4', '2 3'];
    for (const [key, title] of [kErrors[0], kErrors[3]]) {
      const series = told.map((r, i) => ({
                                name: r.name,
                                colour: `var(--${colours[i % 7]})`,
                                dash: dashes[Math.floor(i / 7) % 3],
                                x: r.errors.distance_m,
                                y: r.errors.corrected[key]
                              }));
      Chart.draw(el('all-charts'), {
        title: `Corrected: ${title.charAt(0).toLowerCase()}${title.slice(1)}`,
        digits: 3,
        xName: kDriven,
        series
      });
    }
  }

  function showWorkCharts(run) {
    const f = run.frames, box = el('work-charts');
    box.innerHTML = '';
    if (!f.frame.length) return;
    const chart = (title, unit, curves) => {
      const names = ['visual odometry', 'boulders', 'registration'];
      const series = names.map(
          (name, i) =>
              ({name, colour: jobLine(name), dash: i === 2 ? '3 3' : '', y: curves[i].map((v) => v / unit)}));
      Chart.draw(box, {title, digits: 1, x: f.distance_m, xName: kDriven, series});
    };
    chart('Million operations a frame', 1e6, [f.vo_ops, f.boulder_ops, f.fix_ops]);
    chart('Milliseconds a frame', 1, [f.vo_ms, f.boulder_ms, f.fix_ms]);
  }

  // ---- all of it ----
  function showForecast(run) {
    const forecast = run.summary.forecast, note = el('forecast-words');
    note.hidden = !forecast;
    if (!forecast) return;
    note.textContent = forecast.words;
    note.classList.toggle('wrong', forecast.likely_wrong);
  }

  function choose(i) {
    const run = data.runs[i], several = data.runs.length > 1;
    el('run').value = i;
    el('runs')
        .querySelectorAll('tbody tr')
        .forEach((r, k) => r.classList.toggle('chosen', several && k === i));
    el('lead').textContent = Run.lead(run);
    showForecast(run);
    document.querySelectorAll('.truth').forEach((e) => (e.hidden = !run.errors));
    document.querySelectorAll('.no-truth').forEach((e) => (e.hidden = Boolean(run.errors)));
    el('errors-words').textContent = Run.errors(run);
    DriveMap.show(run);
    showErrors(run);
    showClaims(run);
    Pictures.show(run);
    showFixes(run);
    showWork(run);
    showWorkCharts(run);
    showMemory(run);
    showCounts(run);
    el('origin').textContent = Run.origin(run);
  }
  el('run').innerHTML = data.runs.map((r, i) => tag('option', {value: i}, esc(r.name))).join('');
  el('run').addEventListener('change', (e) => choose(+e.target.value));
  el('chooser').hidden = data.runs.length < 2;
  document.querySelectorAll('.any-truth').forEach((e) => (e.hidden = !anyTruth));
  showRuns();
  showTogether();
  choose(0);
})();
