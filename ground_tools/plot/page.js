'use strict';
// What all pages share: their data, text and numbers as markup, tables, colours of jobs.

/* exported Page */
const Page = (() => {
  const el = (id) => document.getElementById(id);

  // A page whose script fails says so, rather than to stand there half empty.
  window.addEventListener('error', (e) => {
    el('fault').textContent = `This page could not be drawn in full: ${e.message}`;
    el('fault').hidden = false;
  });

  const kEscapes = {'&': '&amp;', '<': '&lt;', '>': '&gt;', '"': '&quot;', '\'': '&#39;'};
  /// Text, for where markup stands.
  const esc = (text) => String(text).replace(/[&<>"']/g, (c) => kEscapes[c]);

  /// With a true minus; a dash where nothing is known, and no minus before a zero.
  const number = (v, digits) => {
    if (v === null || v === undefined || !isFinite(v)) return '\u2013';
    return v.toFixed(digits).replace(/^-(?=0\.?0*$)/, '').replace('-', '\u2212');
  };

  /// An element of HTML or SVG around markup. Attributes are text or numbers; undefined ones are left out.
  const tag = (name, attributes, inner = '') => {
    const value = (v) => (typeof v === 'number' ? String(+v.toFixed(3)) : esc(v));
    const given = Object.entries(attributes).filter(([, v]) => v !== undefined);
    return `<${name}${given.map(([key, v]) => ` ${key}="${value(v)}"`).join('')}>${inner}</${name}>`;
  };

  /// A cell is markup, of a number; or it has attributes, too, as words have.
  const words = (text, as = '') => ({text, class: `words ${as}`.trim()});
  const cell = (kind) => (c) => {
    if (typeof c !== 'object') return tag(kind, {}, c);
    const {text, ...attributes} = c;
    return tag(kind, attributes, text);
  };
  const row = (cells, kind = 'td') => tag('tr', {}, cells.map(cell(kind)).join(''));
  /// heads: rows of cells, or one.
  const table = (heads, rows) =>
      tag('thead', {}, (Array.isArray(heads[0]) ? heads : [heads]).map((h) => row(h, 'th')).join('')) +
      tag('tbody', {}, rows.join(''));

  /// A job has the colour of what it gives: VO's path, boulders seen, fixes.
  const kJobs = {'visual odometry': 'vo', 'boulders': 'seen', 'registration': 'fix'};
  const jobLine = (name) => `var(--${kJobs[name] || 'dim'})`;
  const jobArea = (name) => `var(--hue-${kJobs[name] || 'other'})`;

  const data = JSON.parse(el('data').textContent);
  return {data, el, esc, number, tag, words, row, table, jobLine, jobArea};
})();
