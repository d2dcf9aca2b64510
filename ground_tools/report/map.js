'use strict';
// The drive from above: a canvas to drag and to zoom, and what can be pointed at on it.

/* global Chart, Page, Run */
/* exported DriveMap */
const DriveMap = (() => {
  const {el, number, tag} = Page;
  const canvas = el('map'), tip = el('map-tip'), context = canvas.getContext('2d');
  const kLayers = [
    ['ortho', 'orbital image'], ['orbital', 'boulder of the map'], ['ground', 'boulder seen by the rover'],
    ['truth', 'true path'], ['vo', 'VO alone'], ['corrected', 'corrected'],
    ['pairs', 'boulders paired by a fix'], ['fixes', 'fix (hollow: not used)'],
    ['ellipses', 'uncertainty after it (1 sigma)']
  ];
  const kLarger = [1, 2, 5, 10, 20, 50];
  const kTwoPi = 2 * Math.PI;

  const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
  const kTruth = colour('hue-truth'), kVo = colour('hue-vo'), kCorrected = colour('hue-corrected');
  const kFix = colour('hue-fix'), kFixEdge = colour('fix-edge'), kMapped = colour('hue-mapped');
  const kSeen = colour('hue-seen'), kPicture = colour('picture'), kPale = 'rgba(255,255,255,0.85)';

  const on = {}, view = {x: 0, y: 0, scale: 1};
  for (const [name] of kLayers) on[name] = true;
  let run = null, image = null, larger = 1, hot = null, cursor = -1, fixAt = -1, fitted = true,
      waiting = false;

  const px = (x) => canvas.clientWidth / 2 + (x - view.x) * view.scale;
  const py = (y) => canvas.clientHeight / 2 - (y - view.y) * view.scale;
  const mx = (u) => view.x + (u - canvas.clientWidth / 2) / view.scale;
  const my = (v) => view.y - (v - canvas.clientHeight / 2) / view.scale;
  const pointsOf = (path) => path.filter((v, i) => i % 2 === 0).map((x, i) => [x, path[2 * i + 1]]);

  // ---- what is seen ----
  function extent() {
    const points = Object.values(run.paths).map(pointsOf).reduce((a, b) => a.concat(b), []);
    if (!points.length) return [0, 0, 1, 1];
    const over = (k, f, from) => points.reduce((m, p) => f(m, p[k]), from);
    return [
      over(0, Math.min, Infinity), over(1, Math.min, Infinity), over(0, Math.max, -Infinity),
      over(1, Math.max, -Infinity)
    ];
  }

  function redraw() {
    if (waiting) return;
    waiting = true;
    requestAnimationFrame(() => {
      waiting = false;
      draw();
    });
  }

  function fit() {
    const [x0, y0, x1, y1] = extent(), margin = 2 * Math.max(1, 0.06 * Math.max(x1 - x0, y1 - y0));
    view.x = (x0 + x1) / 2;
    view.y = (y0 + y1) / 2;
    view.scale = Math.min(canvas.clientWidth / (x1 - x0 + margin), canvas.clientHeight / (y1 - y0 + margin));
    fitted = true;
    redraw();
  }

  function zoom(factor, u, v) {
    const x = mx(u), y = my(v);
    view.scale = Math.max(0.5, Math.min(5000, view.scale * factor));
    view.x = x - (u - canvas.clientWidth / 2) / view.scale;
    view.y = y + (v - canvas.clientHeight / 2) / view.scale;
    fitted = false;
    redraw();
  }

  function move(du, dv) {
    view.x -= du / view.scale;
    view.y += dv / view.scale;
    fitted = false;
    redraw();
  }

  // ---- drawing ----
  /// The same line again and again, the widest first: [[colour, width], ...].
  function stroke(...lines) {
    for (const [style, width] of lines) {
      context.strokeStyle = style;
      context.lineWidth = width;
      context.stroke();
    }
  }

  function trace(points, close = false) {
    context.beginPath();
    points.forEach(([u, v], i) => (i === 0 ? context.moveTo(u, v) : context.lineTo(u, v)));
    if (close) context.closePath();
  }

  function fill(style, alpha = 1) {
    context.fillStyle = style;
    context.globalAlpha = alpha;
    context.fill();
    context.globalAlpha = 1;
  }

  function drawPath(path, style, width, dash) {
    trace(pointsOf(path).map(([x, y]) => [px(x), py(y)]));
    stroke(['rgba(255,255,255,0.6)', width + 1.6]);
    context.setLineDash(dash);
    stroke([style, width]);
    context.setLineDash([]);
  }

  function drawDiscs(xs, ys, sizes, least, style) {
    xs.forEach((x, i) => {
      const u = px(x), v = py(ys[i]), r = Math.max(least, 0.5 * sizes[i] * view.scale);
      if (u < -r || v < -r || u > canvas.clientWidth + r || v > canvas.clientHeight + r) return;
      context.beginPath();
      context.arc(u, v, r, 0, kTwoPi);
      style();
    });
  }

  /// From each ground boulder to the map's that it goes with, as they lay once the fix was applied.
  function drawPairs() {
    const p = run.pairs;
    p.frame.forEach((frame, i) => {
      trace([[px(p.x_m[i]), py(p.y_m[i])], [px(p.map_x_m[i]), py(p.map_y_m[i])]]);
      stroke(['#fff', 4], [kFixEdge, 2]);
    });
  }

  /// Half axes (m) of a fix's uncertainty, and the direction of the longer one.
  function ellipseOf(i) {
    const f = run.fixes, sx = f.sigma_x_m[i], sy = f.sigma_y_m[i];
    const a = sx ** 2, b = sy ** 2, c = f.correlation_xy[i] * sx * sy;
    const mean = (a + b) / 2, root = Math.hypot((a - b) / 2, c);
    return [
      Math.sqrt(Math.max(0, mean + root)), Math.sqrt(Math.max(0, mean - root)), Math.atan2(2 * c, a - b) / 2
    ];
  }

  function drawFix(i) {
    const f = run.fixes, u = px(f.x_m[i]), v = py(f.y_m[i]), used = Run.isUsed(run, i), k = 7;
    if (on.ellipses && used) {
      const [long, short, angle] = ellipseOf(i);
      context.beginPath();
      context.ellipse(u, v, larger * long * view.scale, larger * short * view.scale, -angle, 0, kTwoPi);
      fill(kFix, 0.18);
      stroke(['rgba(255,255,255,0.9)', 3], [kFixEdge, 1.5]);
    }
    if (!on.fixes) return;
    if (used) {
      trace([[px(f.x_m[i] - larger * f.dx_m[i]), py(f.y_m[i] - larger * f.dy_m[i])], [u, v]]);
      stroke(['#fff', 4], [kFixEdge, 2]);
    }
    trace([[u, v - k], [u + k, v], [u, v + k], [u - k, v]], true);
    fill(used ? kFix : kPale);
    stroke(used ? ['#fff', 1.4] : [kFixEdge, 2]);
  }

  /// A length, and north.
  function drawScale() {
    const metres = Chart.niceStep(canvas.clientWidth / view.scale, 9), length = metres * view.scale;
    const v = canvas.clientHeight - 16;
    context.fillStyle = kPale;
    context.fillRect(8, v - 24, length + 16, 32);
    context.fillRect(8, 8, 30, 46);
    trace([[16, v - 4], [16, v + 2], [16 + length, v + 2], [16 + length, v - 4]]);
    stroke(['#000', 2]);
    trace([[23, 12], [29, 32], [23, 28], [17, 32]], true);
    fill('#000');
    context.font = '12px system-ui, Arial, sans-serif';
    context.textAlign = 'center';
    context.fillText(`${+ metres.toFixed(3)} m`, 16 + length / 2, v - 8);
    context.fillText('N', 23, 48);
  }

  function drawRing(x, y, r) {
    context.beginPath();
    context.arc(px(x), py(y), r, 0, kTwoPi);
    stroke(['#000', 4.5], ['#fff', 2.2]);
  }

  function draw() {
    const ratio = window.devicePixelRatio || 1, width = canvas.clientWidth, height = canvas.clientHeight;
    const columns = Math.round(width * ratio), rows = Math.round(height * ratio);
    if (canvas.width !== columns || canvas.height !== rows) [canvas.width, canvas.height] = [columns, rows];
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.fillStyle = kPicture;
    context.fillRect(0, 0, width, height);
    if (on.ortho && image && image.complete && image.naturalWidth) {
      const [x0, y0] = run.ortho.low_m, [x1, y1] = run.ortho.high_m;
      context.globalAlpha = 0.8;
      context.drawImage(image, px(x0), py(y1), (x1 - x0) * view.scale, (y1 - y0) * view.scale);
      context.globalAlpha = 1;
    }
    const o = run.orbital, g = run.ground;
    if (on.orbital) {
      drawDiscs(o.x_m, o.y_m, o.diameter_m, 2.5, () => stroke(['rgba(0,0,0,0.55)', 3], [kMapped, 1.6]));
    }
    if (on.ground) {
      drawDiscs(g.x, g.y, g.size, 3, () => {
        fill(kSeen, 0.75);
        stroke(['#fff', 1]);
      });
    }
    if (on.pairs) drawPairs();
    if (on.truth) drawPath(run.paths.truth, kTruth, 6, []);
    if (on.vo) drawPath(run.paths.vo, kVo, 2.2, [8, 4]);
    if (on.corrected) drawPath(run.paths.corrected, kCorrected, 2.2, []);
    run.fixes.frame.forEach((frame, i) => drawFix(i));
    for (const [name, path] of Object.entries(run.paths)) {
      const there = cursor >= 0 && on[name] && 2 * cursor + 1 < path.length;
      if (there) drawRing(path[2 * cursor], path[2 * cursor + 1], 6);
    }
    if (hot) drawRing(hot.x, hot.y, Math.max(10, hot.r * view.scale + 4));
    drawScale();
    const across = width / view.scale;
    el('map-shown').textContent = `Shown: ${number(across, across < 10 ? 2 : 1)} m across.`;
  }

  // ---- pointing ----
  function fixTip(i) {
    const f = run.fixes, used = Run.isUsed(run, i), [long, short] = ellipseOf(i);
    const lines = [
      `Fix at frame ${f.frame[i]}, ${number(f.distance_m[i], 1)} m driven`, Run.status('fixes', f.status[i])
    ];
    if (used) {
      lines.push(
          `moved by ${number(f.dx_m[i], 3)}, ${number(f.dy_m[i], 3)} m; ${f.pairs[i]} pairs of boulders, ` +
              `${number(f.rms_m[i], 3)} m apart`,
          `uncertainty ${number(long, 3)} by ${number(short, 3)} m`);
      if (f.after_m[i] !== null) {
        lines.push(`error ${number(f.before_m[i], 3)} m before, ${number(f.after_m[i], 3)} m after`);
      }
    }
    return {x: f.x_m[i], y: f.y_m[i], r: 0, text: lines.join('\n')};
  }

  function pathTip(name, k) {
    const path = run.paths[name], frames = run.frames, whole = frames.frame.length;
    const title = {truth: 'True path', vo: 'VO alone', corrected: 'Corrected path'}[name];
    const known = name !== 'truth' || path.length === 2 * whole;
    const told = run.errors && name !== 'truth' && run.errors.distance_m.length === whole;
    const place = known ? `, frame ${frames.frame[k]}\n${number(frames.distance_m[k], 1)} m driven` : '';
    const error = told ? `, error ${number(run.errors[name].xy_m[k], 3)} m` : '';
    return {x: path[2 * k], y: path[2 * k + 1], r: 0, text: title + place + error};
  }

  /// The thing nearest to a place on the screen: fixes first, then boulders, then paths.
  function nearest(u, v) {
    let best = null, least = 14;
    const offer = (x, y, reach, make) => {
      const d = Math.hypot(px(x) - u, py(y) - v) - reach;
      if (d < least) [least, best] = [d, make];
    };
    const f = run.fixes, g = run.ground, o = run.orbital;
    const reach = (size) => Math.max(2.5, 0.5 * size * view.scale);
    if (on.fixes) f.frame.forEach((frame, i) => offer(f.x_m[i], f.y_m[i], 0, () => fixTip(i)));
    if (best) return best();
    least = 5;
    if (on.ground) {
      g.id.forEach(
          (id, i) => offer(
              g.x[i], g.y[i], reach(g.size[i]),
              () => ({
                x: g.x[i],
                y: g.y[i],
                r: g.size[i] / 2,
                text: `Boulder ${id}, seen by the rover\n${number(g.size[i], 2)} m wide, seen in ${
                    g.sightings[i]} frames`
              })));
    }
    if (on.orbital) {
      o.x_m.forEach(
          (x, i) => offer(
              x, o.y_m[i], reach(o.diameter_m[i]),
              () => ({
                x,
                y: o.y_m[i],
                r: o.diameter_m[i] / 2,
                text: `Boulder of the orbital map\n${number(o.diameter_m[i], 2)} m wide`
              })));
    }
    if (best) return best();
    least = 8;
    for (const name of ['corrected', 'vo', 'truth'].filter((n) => on[n])) {
      pointsOf(run.paths[name]).forEach(([x, y], k) => offer(x, y, 0, () => pathTip(name, k)));
    }
    return best && best();
  }

  function tell(thing) {
    hot = thing;
    tip.hidden = !thing;
    if (thing) {
      tip.textContent = thing.text;
      const u = px(thing.x), v = py(thing.y), wide = tip.offsetWidth, high = tip.offsetHeight;
      const room = canvas.clientWidth - wide - 4, left = u + 14 > room ? u - wide - 14 : u + 14;
      tip.style.left = `${Math.max(4, Math.min(room, left))}px`;
      tip.style.top = `${Math.max(4, Math.min(canvas.clientHeight - high - 4, v + 14))}px`;
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

  // ---- hands ----
  function all() {
    tell(null);
    fit();
  }
  function zoomMiddle(factor) {
    zoom(factor, canvas.clientWidth / 2, canvas.clientHeight / 2);
    tell(null);
  }

  function startPointers() {
    const touches = new Map();
    canvas.addEventListener('pointerdown', (e) => {
      canvas.setPointerCapture(e.pointerId);
      touches.set(e.pointerId, [e.offsetX, e.offsetY]);
      canvas.classList.add('dragged');
      tell(nearest(e.offsetX, e.offsetY));
    });
    canvas.addEventListener('pointermove', (e) => {
      const before = touches.get(e.pointerId), u = e.offsetX, v = e.offsetY;
      if (!before) {
        tell(nearest(u, v));
        return;
      }
      const du = u - before[0], dv = v - before[1];
      if (touches.size === 1) {
        move(du, dv);
        if (Math.hypot(du, dv) > 2) tell(null);
      } else if (touches.size === 2) {
        const other = [...touches].find(([id]) => id !== e.pointerId)[1];
        const was = Math.hypot(before[0] - other[0], before[1] - other[1]);
        const is = Math.hypot(u - other[0], v - other[1]);
        if (was > 1) zoom(is / was, (u + other[0]) / 2, (v + other[1]) / 2);
        move(du / 2, dv / 2);
        tell(null);
      }
      touches.set(e.pointerId, [u, v]);
    });
    for (const end of ['pointerup', 'pointercancel']) {
      canvas.addEventListener(end, (e) => {
        touches.delete(e.pointerId);
        if (!touches.size) canvas.classList.remove('dragged');
      });
    }
    canvas.addEventListener('pointerleave', () => {
      if (!touches.size) tell(null);
    });
    canvas.addEventListener('wheel', (e) => {
      e.preventDefault();
      zoom(Math.exp(-Math.max(-120, Math.min(120, e.deltaY)) / 300), e.offsetX, e.offsetY);
      tell(null);
    }, {passive: false});
  }

  function startKeys() {
    const step = 60;
    const actions = {
      ArrowLeft: () => move(step, 0),
      ArrowRight: () => move(-step, 0),
      ArrowUp: () => move(0, step),
      ArrowDown: () => move(0, -step),
      '+': () => zoomMiddle(1.4),
      '=': () => zoomMiddle(1.4),
      '-': () => zoomMiddle(1 / 1.4),
      '0': all,
      n: () => showFix(fixAt + 1),
      p: () => showFix(Math.max(fixAt, 0) - 1),
      Escape: () => tell(null),
    };
    canvas.addEventListener('keydown', (e) => {
      const action = actions[e.key.length === 1 ? e.key.toLowerCase() : e.key];
      if (!action || e.ctrlKey || e.metaKey || e.altKey) return;
      e.preventDefault();
      action();
    });
    el('zoom-in').addEventListener('click', () => zoomMiddle(1.6));
    el('zoom-out').addEventListener('click', () => zoomMiddle(1 / 1.6));
    el('zoom-all').addEventListener('click', all);
  }

  // ---- layers ----
  function swatch(name) {
    const line = (style, width, dash) => {
      const d = 'M2 9h26';
      return tag('path', {d, stroke: '#fff', 'stroke-width': width + 2}) +
          tag('path', {d, stroke: style, 'stroke-width': width, 'stroke-dasharray': dash});
    };
    const disc = (attributes) => tag('circle', {cx: 15, cy: 9, r: 5, ...attributes});
    const stone = (cx, cy, r) => tag('circle', {cx, cy, r, fill: colour('stone')});
    const whole = {width: 30, height: 18};
    const inside = {
      ortho: () => tag('rect', {...whole, fill: colour('sand')}) + stone(10, 8, 3) + stone(21, 11, 2),
      orbital: () => disc({fill: 'none', stroke: '#0009', 'stroke-width': 3.5}) +
          disc({fill: 'none', stroke: kMapped, 'stroke-width': 2}),
      ground: () => disc({fill: kSeen, stroke: '#fff'}),
      truth: () => line(kTruth, 5),
      vo: () => line(kVo, 2.4, '7 3'),
      corrected: () => line(kCorrected, 2.4),
      pairs: () => disc({r: 3, cx: 9, fill: kSeen}) + disc({r: 4, cx: 21, fill: 'none', stroke: kMapped}) +
          line(kFixEdge, 1.6),
      fixes: () => tag('path', {d: 'M15 2l6 7-6 7-6-7z', fill: kFix, stroke: '#fff'}),
      ellipses: () => tag('ellipse', {
        cx: 15,
        cy: 9,
        rx: 9,
        ry: 5,
        fill: kFix,
        'fill-opacity': 0.33,
        stroke: kFixEdge,
        'stroke-width': 1.5
      }),
    };
    const plate = tag('rect', {...whole, fill: kPicture});
    return tag('svg', {...whole, viewBox: '0 0 30 18', 'aria-hidden': 'true'}, plate + inside[name]());
  }

  function showLayers() {
    const there = {
      ortho: run.ortho !== null,
      orbital: run.orbital.x_m.length,
      ground: run.ground.id.length,
      truth: run.paths.truth.length,
      vo: true,
      corrected: true,
      pairs: run.pairs.frame.length,
      fixes: run.fixes.frame.length,
      ellipses: run.fixes.status.includes('applied'),
    };
    const box = (name) => {
      const checked = on[name] ? '' : undefined;
      return tag('input', {type: 'checkbox', 'data-layer': name, checked});
    };
    const option = (k) =>
        tag('option', {value: k, selected: k === larger ? '' : undefined},
            k === 1 ? 'as they are' : `${k} times larger`);
    let html = kLayers.filter(([name]) => there[name])
                   .map(([name, said]) => tag('label', {}, box(name) + swatch(name) + said))
                   .join('');
    if (there.ellipses) {
      const select = tag('select', {id: 'larger'}, kLarger.map(option).join(''));
      html += tag('label', {}, `corrections and uncertainties drawn ${select}`);
    }
    el('layers').innerHTML = html;
    el('layers').querySelectorAll('[data-layer]').forEach((c) => c.addEventListener('change', () => {
      on[c.dataset.layer] = c.checked;
      redraw();
    }));
    if (!there.ellipses) return;
    el('larger').addEventListener('change', (e) => {
      larger = +e.target.value;
      redraw();
    });
  }

  /// So that the longest correction or half axis is at most a 15th of the view.
  function enlargement() {
    const f = run.fixes, [x0, y0, x1, y1] = extent(), most = Math.max(x1 - x0, y1 - y0) / 15;
    const lengths =
        f.frame.map((frame, i) => i)
            .filter((i) => Run.isUsed(run, i))
            .map((i) => Math.max(Math.hypot(f.dx_m[i], f.dy_m[i]), f.sigma_x_m[i], f.sigma_y_m[i]));
    const longest = Math.max(1e-6, ...lengths);
    return [...kLarger].reverse().find((k) => k * longest <= most) || 1;
  }

  function show(shown) {
    run = shown;
    image = null;
    if (run.ortho) {
      image = new Image();
      image.onload = redraw;
      image.src = Run.jpeg(run.ortho.jpeg);
    }
    larger = enlargement();
    cursor = fixAt = -1;
    showLayers();
    all();
  }

  startPointers();
  startKeys();
  new ResizeObserver(() => {
    if (!run) return;
    if (fitted) {
      fit();
    } else {
      redraw();
    }
  }).observe(canvas);
  const pointAt = (i) => {
    cursor = i;
    redraw();
  };
  return {show, showFix, pointAt};
})();
