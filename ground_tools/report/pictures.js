'use strict';
// What the rover saw: regions, labels over time, points and boulders from above.

/* global Page, Run */
/* exported Pictures */
const Pictures = (() => {
  const {el, number, tag} = Page;
  const kNoLabel = '#bbb', kFont = 'system-ui, Arial, sans-serif';
  const kName = {
    'font-size': 19,
    'font-weight': 700,
    'font-family': kFont,
    'paint-order': 'stroke',
    fill: '#fff',
    stroke: '#000',
    'stroke-width': 4
  };
  const labelled = (label) => (label ? `var(--label-${label % 7})` : kNoLabel);
  const boulders = (n) => `${n} ${n === 1 ? 'boulder' : 'boulders'}`;
  const told = (text, markup) => tag('g', {}, tag('title', {}, text) + markup);
  const dot = (cx, cy, r, fill) => tag('circle', {cx, cy, r, fill, stroke: '#000', 'stroke-width': 0.5});

  let run = null, strip = null;

  /// A picture of the left camera with things drawn over it.
  function overPicture(p, over) {
    const picture = tag('image', {href: Run.jpeg(p.jpeg), width: p.width, height: p.height});
    const said = `Left image of frame ${p.frame}`;
    return tag(
        'svg', {viewBox: `0 0 ${p.width || 4} ${p.height || 3}`, role: 'img', 'aria-label': said},
        (p.jpeg >= 0 ? picture : '') + over);
  }

  // ---- regions ----
  /// Of each label, paths in pixels of the image: `fill` in strips, `edge` along the borders.
  function regionPaths(r) {
    const labels = new Uint8Array(r.width * r.height), d = r.divisor;
    for (let i = 0, at = 0; i < r.runs.length; at += r.runs[i + 1], i += 2) {
      labels.fill(r.runs[i], at, at + r.runs[i + 1]);
    }
    const get = (x, y) => (x < 0 || y < 0 || x >= r.width || y >= r.height ? 0 : labels[y * r.width + x]);
    const lengthOf = (x, y, dx, dy, goesOn) => {
      let n = 0;
      while (goesOn(x + n * dx, y + n * dy)) ++n;
      return n;
    };
    const regions = new Map();
    for (let y = 0; y < r.height; ++y) {
      for (let x = 0; x < r.width; ++x) {
        const label = get(x, y);
        if (!label) continue;
        if (!regions.has(label)) regions.set(label, {fill: '', edge: '', pixels: 0});
        const region = regions.get(label), own = (u, v) => get(u, v) === label;
        ++region.pixels;
        if (!own(x - 1, y)) {
          const wide = d * lengthOf(x, y, 1, 0, own);
          region.fill += `M${d * x} ${d * y}v${d}h${wide}v${0 - d}z`;
        }
        for (const side of [-1, 1]) {  // each straight piece of border once, from its left or upper end
          const level = (u, v) => own(u, v) && !own(u, v + side);
          const upright = (u, v) => own(u, v) && !own(u + side, v);
          if (level(x, y) && !level(x - 1, y)) {
            region.edge += `M${d * x} ${d * (side < 0 ? y : y + 1)}h${d * lengthOf(x, y, 1, 0, level)}`;
          }
          if (upright(x, y) && !upright(x, y - 1)) {
            region.edge += `M${d * (side < 0 ? x : x + 1)} ${d * y}v${d * lengthOf(x, y, 0, 1, upright)}`;
          }
        }
      }
    }
    return regions;
  }

  function regionOver(label, r, pixels, isBoulder) {
    const said = isBoulder ? 'stands above the ground: a boulder, or a part of one' :
                             'does not stand above the ground: sand, shadow, or too far to tell';
    const edge = (stroke, width, alpha = 1) =>
        tag('path', {d: r.edge, fill: 'none', stroke, 'stroke-width': width, 'stroke-opacity': alpha});
    const area = tag('path', {d: r.fill, fill: labelled(label), 'fill-opacity': isBoulder ? 0.45 : 0.22});
    const outline = isBoulder ? edge('#000', 4, 0.6) + edge('#fff', 2.2) : edge(labelled(label), 0.8);
    return told(`Region ${label}, ${pixels} pixels: ${said}`, area + outline);
  }

  function showRegions() {
    const p = strip[strip.length - 1];
    let over = '';
    if (p.regions && el('show-regions').checked) {
      const evident = new Set(p.points.filter((q) => q[5] > 0 && q[4] > 0).map((q) => q[4]));
      for (const [label, r] of regionPaths(p.regions)) {
        over += regionOver(label, r, r.pixels * p.regions.divisor ** 2, evident.has(label));
      }
    }
    if (el('show-points').checked) over += p.points.map((q) => dot(q[0], q[1], 1.8, labelled(q[5]))).join('');
    const said = p.jpeg < 0 ? 'the image is missing.' : `${boulders(p.boulders.length)}.`;
    el('regions').innerHTML = overPicture(p, over) + tag('p', {class: 'small'}, `Frame ${p.frame}: ${said}`);
  }

  // ---- labels ----
  function labelledPicture(p) {
    const placed = [];  // where numbers stand: of two that would overlap, the larger boulder's
    const one = ([label, , , size, count, seen]) => {
      const own = p.points.filter((q) => q[5] === label);
      if (!own.length) return '';
      const middle = own.reduce((a, q) => a + q[0], 0) / own.length;
      const top = own.reduce((a, q) => Math.min(a, q[1]), 1e9);
      const u = Math.max(20, Math.min(p.width - 20, middle)), v = Math.max(20, top - 6);
      const free = placed.every(([x, y]) => Math.abs(x - u) > 40 || Math.abs(y - v) > 18);
      if (free) placed.push([u, v]);
      const text = tag('text', {x: u, y: v, 'text-anchor': 'middle', ...kName}, label);
      const known = seen ? 'known from the frame before' : 'new in this frame';
      return told(
          `Boulder ${label}: ${count} points, ${number(size, 2)} m wide, ${known}`,
          own.map((q) => dot(q[0], q[1], 2.6, labelled(label))).join('') + (free ? text : ''));
    };
    const over = [...p.boulders].sort((a, b) => b[4] - a[4]).map(one).join('');
    return tag('figure', {}, overPicture(p, over) + tag('figcaption', {}, `frame ${p.frame}`));
  }

  // ---- from above ----
  /// Points on the orbital image, coloured by label(point), with the boulders where they are asked for.
  function plan(p, name, label, withBoulders) {
    const kSide = 400;
    const xs = [...p.points.map((q) => q[2]), p.camera_m[0]];
    const ys = [...p.points.map((q) => q[3]), p.camera_m[1]];
    const low = (v) => v.reduce((a, b) => Math.min(a, b)), high = (v) => v.reduce((a, b) => Math.max(a, b));
    const span = Math.max(2, high(xs) - low(xs), high(ys) - low(ys)) + 0.6, k = kSide / span;
    const x0 = (low(xs) + high(xs) - span) / 2, y1 = (low(ys) + high(ys) + span) / 2;
    const u = (x) => (x - x0) * k, v = (y) => (y1 - y) * k;
    const ring = (x, y, r, stroke, width, more = {}) =>
        tag('circle', {cx: u(x), cy: v(y), r, fill: 'none', stroke, 'stroke-width': width, ...more});

    const ground = () => {
      const [lx, ly] = run.ortho.low_m, [hx, hy] = run.ortho.high_m;
      return tag('image', {
        href: Run.jpeg(run.ortho.jpeg),
        x: u(lx),
        y: v(hy),
        width: (hx - lx) * k,
        height: (hy - ly) * k,
        preserveAspectRatio: 'none',
        opacity: 0.8
      });
    };
    const mapped = (x, i) => {
      const y = run.orbital.y_m[i], size = run.orbital.diameter_m[i], r = Math.max(3, 0.5 * size * k);
      if (x < x0 || x > x0 + span || y > y1 || y < y1 - span) return '';
      return told(
          `Boulder of the orbital map, ${number(size, 2)} m wide`,
          ring(x, y, r, '#000', 4, {'stroke-opacity': 0.5}) + ring(x, y, r, 'var(--hue-mapped)', 2));
    };
    const seen = ([id, x, y, size, count]) => told(
        `Boulder ${id}: ${count} points, ${number(size, 2)} m wide`,
        ring(x, y, size / 2 * k, '#000', 3.5, {fill: '#fff', 'fill-opacity': 0.01}) +
            ring(x, y, size / 2 * k, '#fff', 1.8));
    const camera = () => {
      const [x, y] = p.camera_m, corner = (turn, r) => {
        const a = p.heading_rad + turn;
        return `${(u(x) + r * Math.cos(a)).toFixed(1)},${(v(y) - r * Math.sin(a)).toFixed(1)}`;
      };
      const points = [corner(0, 14), corner(2.5, 10), corner(-2.5, 10)].join(' ');
      return tag(
          'polygon', {points, fill: 'var(--hue-corrected)', stroke: '#fff', 'stroke-width': 1.5},
          tag('title', {}, 'The camera'));
    };
    const scale = () => {
      const metres = k >= 100 ? 0.5 : 1, long = metres * k;
      return tag('rect', {x: 8, y: 366, width: long + 12, height: 28, fill: '#fff', 'fill-opacity': 0.8}) +
          tag('path', {d: `M14 386v4h${long}v-4`, fill: 'none', stroke: '#000', 'stroke-width': 2}) +
          tag('text',
              {x: 14 + long / 2, y: 382, 'text-anchor': 'middle', 'font-size': 13, 'font-family': kFont},
              `${metres} m`);
    };

    const over = tag('rect', {width: kSide, height: kSide, fill: '#777'}) + (run.ortho ? ground() : '') +
        run.orbital.x_m.map(mapped).join('') +
        p.points.map((q) => dot(u(q[2]), v(q[3]), 2.4, labelled(label(q)))).join('') +
        (withBoulders ? p.boulders.map(seen).join('') : '') + camera() + scale();
    const said = `Points from above, ${name}`;
    return tag(
        'figure', {},
        tag('svg', {viewBox: `0 0 ${kSide} ${kSide}`, role: 'img', 'aria-label': said}, over) +
            tag('figcaption', {}, name));
  }

  // ---- strips ----
  function showStrip(i) {
    strip = run.strips[i];
    el('strip-buttons')
        .querySelectorAll('button')
        .forEach((b, k) => b.setAttribute('aria-pressed', String(k === i)));
    const last = strip[strip.length - 1];
    el('strip-words').textContent =
        'The rover must know that a boulder of one frame is that of the next. 3D points of ' +
        'the last frame vote for the boulders of this one, from frame to frame. ' +
        (strip.length > 1 ? `These frames are ${run.stride} apart: ` : '') +
        'the same number and colour is the same boulder, as the rover believes. A number goes where a ' +
        'boulder leaves the image or is missed once.';
    showRegions();
    el('labels').innerHTML = strip.map(labelledPicture).join('');
    el('clusters').innerHTML = plan(last, 'before grouping, by region', (q) => q[4], false) +
        plan(last, `after grouping: ${boulders(last.boulders.length)}`, (q) => q[5], true);
  }

  function show(shown) {
    run = shown;
    strip = null;
    const any = run.strips.some((s) => s.length);
    el('strips').hidden = !any;
    el('no-strips').hidden = any;
    if (!any) return;
    const button = (s) => {
      const frame = s[s.length - 1].frame, driven = run.frames.distance_m[run.frames.frame.indexOf(frame)];
      return tag('button', {type: 'button'}, `frame ${frame}, ${number(driven, 1)} m`);
    };
    el('strip-buttons').innerHTML = run.strips.map(button).join('');
    el('strip-buttons')
        .querySelectorAll('button')
        .forEach((b, i) => b.addEventListener('click', () => showStrip(i)));
    showStrip(0);
  }

  for (const id of ['show-regions', 'show-points']) {
    el(id).addEventListener('change', () => {
      if (strip) showRegions();
    });
  }
  return {show};
})();
