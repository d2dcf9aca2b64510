'use strict';
// Curves over the distance driven, with a hair that follows the pointer or the arrow keys.

/* global Page */
/* exported Chart */
const Chart = (() => {
  const {esc, number, tag} = Page;

  /// The round number next above a `count`-th of a span.
  function niceStep(span, count) {
    const raw = span / count, power = Math.pow(10, Math.floor(Math.log10(raw)));
    return [1, 2, 5, 10].map((f) => f * power).find((step) => raw <= step * 1.0000001);
  }
  const decimals = (step) => Math.max(0, Math.min(6, Math.ceil(-Math.log10(step) - 1e-9)));
  const clamped = (i, list) => list[Math.min(i, list.length - 1)];

  const kHeight = 220, kLeft = 50, kRight = 12, kTop = 10, kBottom = 40;

  /// what: {title, digits, x, xName, series: [{name, colour, dash, x, y}], marks: [x],
  /// band: {name, x, y, both}, spans: [{name, colour, from, to}]}; a series without x has that of all. A band
  /// is shaded from 0 up, or to both sides, as far as there is room for it; spans are a strip at the foot.
  /// `limit`: where the axis ends, and curves that go beyond it.
  /// pick(i) is told which point is pointed at, -1 for none.
  function draw(parent, what, pick) {
    const figure = document.createElement('figure');
    figure.className = 'chart';
    figure.innerHTML = tag('figcaption', {}, esc(what.title)) + tag('div', {class: 'said'}) +
        tag('svg', {tabindex: 0, role: 'img', 'aria-label': `${what.title}. Arrow keys go along the curve.`});
    parent.appendChild(figure);
    const svg = figure.querySelector('svg'), said = figure.querySelector('.said');

    const xs = what.series.map((s) => s.x || what.x);
    const far = Math.max(1e-6, ...xs.map((x) => x.reduce((m, v) => Math.max(m, v), 0)));
    let low = 0, high = 0;
    for (const s of what.series) {
      low = s.y.reduce((m, v) => (v < m ? v : m), low);
      high = s.y.reduce((m, v) => (v > m ? v : m), high);
    }
    if (what.limit > 0) high = Math.min(high, what.limit);
    if (what.band) {
      const most = what.band.y.reduce((m, v) => Math.max(m, v), 0);
      const edge = Math.min(most, 2.5 * Math.max(high, -low));
      high = Math.max(high, edge);
      if (what.band.both) low = Math.min(low, -edge);
    }
    if (high - low < 1e-9) high = low + 1;
    const stepY = niceStep((high - low) * 1.05, 4);
    low = Math.floor(low / stepY + 1e-9) * stepY;
    high = Math.ceil(high / stepY - 1e-9) * stepY;

    let width = 0, at = -1;
    const px = (x) => kLeft + x / far * (width - kLeft - kRight);
    const py = (y) => kTop + (high - y) / (high - low) * (kHeight - kTop - kBottom);

    function say() {
      const key = (s) =>
          tag('i', {class: s.dash ? 'dashed' : '', style: `border-color:${s.colour}`}) + esc(s.name);
      const value = (s) => (at < 0 || !s.y.length ? '' : `: <b>${number(clamped(at, s.y), what.digits)}</b>`);
      const place = at < 0 ? '' : tag('span', {}, `at ${number(clamped(at, xs[0]), 1)} m`);
      const plate = (name, as, style) => tag('span', {}, tag('i', {class: as, style}) + esc(name));
      const band = what.band ? plate(what.band.name, 'band', '') : '';
      const states = new Map((what.spans || []).map((s) => [s.name, s.colour]));
      const strip = [...states].map(([name, c]) => plate(name, '', `border-color:${c}`)).join('');
      said.innerHTML =
          what.series.map((s) => tag('span', {}, key(s) + value(s))).join('') + band + strip + place;
    }

    function hair() {
      const x = at < 0 ? -10 : px(clamped(at, xs[0]));
      for (const end of ['x1', 'x2']) svg.querySelector('.hair').setAttribute(end, x);
    }

    function paint() {
      width = Math.max(260, svg.clientWidth || parent.clientWidth || 300);
      svg.setAttribute('viewBox', `0 0 ${width} ${kHeight}`);
      svg.setAttribute('height', kHeight);
      const text = (x, y, anchor, words) => tag('text', {x, y, 'text-anchor': anchor}, words);
      const upright = (x, as) => tag('line', {class: as, x1: x, x2: x, y1: kTop, y2: kHeight - kBottom});
      let out = '';
      for (let y = low; y <= high + stepY * 1e-6; y += stepY) {
        const shown = Math.abs(y) < stepY * 1e-6 ? 0 : y;
        out += tag('line', {class: 'grid', x1: kLeft, x2: width - kRight, y1: py(y), y2: py(y)}) +
            text(kLeft - 6, py(y) + 4, 'end', number(shown, decimals(stepY)));
      }
      const stepX = niceStep(far, Math.max(3, Math.floor(width / 80)));
      for (let x = 0; x <= far * 1.000001; x += stepX) {
        out += text(px(x), kHeight - kBottom + 17, 'middle', number(x, decimals(stepX)));
      }
      out += text((kLeft + width - kRight) / 2, kHeight - 5, 'middle', esc(what.xName));
      if (what.band) {
        const {x, y, both} = what.band;
        const edge = (sign) => y.map(
            (v, i) => `${px(x[i]).toFixed(1)},${py(Math.max(low, Math.min(sign * v, high))).toFixed(1)}`);
        const points = [...edge(1), ...edge(both ? -1 : 0).reverse()].join(' ');
        out += tag('polygon', {class: 'band', points});
      }
      out += (what.spans || [])
                 .map((s) => tag('rect', {
                        class: 'span',
                        x: px(s.from),
                        y: kHeight - kBottom - 5,
                        width: Math.max(1, px(s.to) - px(s.from)),
                        height: 5,
                        style: `fill:${s.colour}`
                      }))
                 .join('');
      out += (what.marks || []).map((x) => upright(px(x), 'fixline')).join('');
      what.series.forEach((s, k) => {
        const place = (v, i) => `${px(xs[k][i]).toFixed(1)},${py(Math.min(v, high)).toFixed(1)}`;
        const points = s.y.map(place).join(' ');
        out += tag(
            'polyline',
            {class: 'curve', style: `stroke:${s.colour}`, 'stroke-dasharray': s.dash || undefined, points});
      });
      svg.innerHTML = out + upright(-10, 'hair');
      hair();
    }

    function goTo(i) {
      at = Math.max(-1, Math.min(xs[0].length - 1, i));
      say();
      hair();
      if (pick) pick(at);
    }
    svg.addEventListener('pointermove', (e) => {
      const box = svg.getBoundingClientRect();
      const u = (e.clientX - box.left) / box.width * width;
      const x = (u - kLeft) / (width - kLeft - kRight) * far;
      goTo(xs[0].reduce((best, v, i) => (Math.abs(v - x) < Math.abs(xs[0][best] - x) ? i : best), 0));
    });
    for (const away of ['pointerleave', 'blur']) svg.addEventListener(away, () => goTo(-1));
    svg.addEventListener('keydown', (e) => {
      const step = {ArrowLeft: -1, ArrowRight: 1, PageDown: 10, PageUp: -10}[e.key];
      if (!step) return;
      e.preventDefault();
      goTo(Math.max(0, at + step));
    });
    say();
    paint();
    new ResizeObserver(() => {
      if (svg.clientWidth && Math.abs(svg.clientWidth - width) > 1) paint();
    }).observe(svg);
  }

  return {draw, niceStep};
})();
