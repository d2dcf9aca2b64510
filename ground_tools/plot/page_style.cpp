#include "plot/single_page.hpp"

namespace cairn::ground {

// Hues are those of Okabe and Ito, "Color Universal Design" (2008); on dark ground vermilion
// and blue are lightened.
const char* const kPageStyle = R"css(
:root { color-scheme: light dark; --back: #ffffff; --ink: #1d2126; --dim: #59616b; --line: #d5d9de; --plate: #f4f5f7;
  --accent: #0072B2; --truth: #000000; --vo: #D55E00; --corrected: #0072B2; --fix: #CC79A7; --third: #007a59; }
@media (prefers-color-scheme: dark) {
  :root { --back: #14171b; --ink: #e8eaed; --dim: #a4acb6; --line: #363c44; --plate: #1d2127;
    --accent: #56B4E9; --truth: #ffffff; --vo: #f08339; --corrected: #4aa8e0; --third: #2fc398; }
}
* { box-sizing: border-box; }
[hidden] { display: none !important; }
html { -webkit-text-size-adjust: 100%; }
body { margin: 0 auto; padding: 0 16px 32px; max-width: 1220px; background: var(--back); color: var(--ink);
  font: 16px/1.5 system-ui, -apple-system, "Segoe UI", Helvetica, Arial, sans-serif; overflow-wrap: break-word; }
h1 { font-size: 1.7rem; line-height: 1.2; margin: 24px 0 8px; }
h2 { font-size: 1.3rem; line-height: 1.25; margin: 40px 0 8px; padding-top: 12px; border-top: 1px solid var(--line); }
h3 { font-size: 1.05rem; margin: 24px 0 4px; }
p { margin: 6px 0 12px; max-width: 78ch; }
.lead { font-size: 1.1rem; }
.small { font-size: 0.86rem; color: var(--dim); }
.note { padding: 10px 12px; background: var(--plate); border-left: 4px solid var(--accent); }
code { font-size: 0.9em; }
a, button, select, input, canvas, svg, .scroll { outline-offset: 2px; }
:focus-visible { outline: 2px solid var(--accent); }
.scroll { overflow-x: auto; border: 1px solid var(--line); border-radius: 6px; margin: 8px 0; }
table { border-collapse: collapse; width: 100%; font-size: 0.86rem; font-variant-numeric: tabular-nums; }
th, td { padding: 5px 8px; text-align: right; white-space: nowrap; border-bottom: 1px solid var(--line); }
tr:last-child td { border-bottom: 0; }
th { background: var(--plate); font-weight: 600; vertical-align: bottom; }
th.words, td.words { text-align: left; }
td.wrap { white-space: normal; min-width: 8em; }
#runs th, #runs td { padding: 5px 6px; }
#fixes td.wrap { min-width: 12em; }
th.group { text-align: center; }
thead tr:first-child th:first-child, td:first-child { position: sticky; left: 0; z-index: 1; }
td:first-child { background: var(--back); }
tr.chosen td { background: color-mix(in srgb, var(--accent) 14%, var(--back)); }
td .bar { display: inline-block; height: 10px; background: var(--accent); border-radius: 2px; min-width: 1px; }
.better { color: var(--third); } .worse { color: var(--vo); }
button, select { font: inherit; color: var(--ink); background: var(--plate); border: 1px solid var(--line); border-radius: 6px;
  padding: 4px 10px; min-height: 36px; cursor: pointer; max-width: 100%; }
button[aria-pressed="true"] { background: var(--accent); border-color: var(--accent); color: var(--back); }
button.link { background: none; border: 0; padding: 0; min-height: 0; color: var(--accent); text-decoration: underline; }
.chooser { position: sticky; top: 0; z-index: 5; background: var(--back); padding: 8px 0; border-bottom: 1px solid var(--line);
  display: flex; flex-wrap: wrap; gap: 8px; align-items: center; }
.layers { display: flex; flex-wrap: wrap; gap: 4px 16px; margin: 8px 0; font-size: 0.9rem; align-items: center; }
.layers label { display: inline-flex; align-items: center; gap: 6px; min-height: 30px; cursor: pointer; }
.layers svg { flex: none; border-radius: 3px; }
.tabs { display: flex; flex-wrap: wrap; gap: 6px; margin: 8px 0; }
.mapbox { position: relative; border: 1px solid var(--line); border-radius: 6px; overflow: hidden; height: min(70vh, 720px); min-height: 320px; }
#map { display: block; width: 100%; height: 100%; touch-action: none; cursor: grab; background: #b4b4b4; }
#map.dragged { cursor: grabbing; }
#map:focus-visible { outline-offset: -3px; }
.buttons { position: absolute; right: 8px; top: 8px; display: flex; flex-direction: column; gap: 4px; }
.buttons button { min-width: 40px; min-height: 40px; padding: 0 6px; background: var(--back); }
.tip { position: absolute; max-width: min(280px, 80%); padding: 6px 9px; font-size: 0.85rem; line-height: 1.35; background: var(--back);
  border: 1px solid var(--line); border-radius: 6px; pointer-events: none; white-space: pre-line; box-shadow: 0 2px 8px rgb(0 0 0 / 25%); }
.charts { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(100%, 430px), 1fr)); gap: 20px 24px; }
.chart { min-width: 0; margin: 0; }
.chart figcaption { font-weight: 600; font-size: 0.95rem; }
.chart .said { font-size: 0.84rem; color: var(--dim); min-height: 1.4em; display: flex; flex-wrap: wrap; gap: 2px 12px; }
.chart .said i { display: inline-block; width: 18px; border-top: 3px solid; margin-right: 5px; vertical-align: middle; }
.chart .said i.dashed { border-top-style: dashed; }
.chart svg { display: block; width: 100%; touch-action: pan-y; }
.chart text { font-size: 12px; fill: var(--dim); }
.chart .grid { stroke: var(--line); stroke-width: 1; }
.chart .fixline { stroke: var(--fix); stroke-width: 1; stroke-dasharray: 2 4; }
.chart .curve { fill: none; stroke-width: 2; stroke-linejoin: round; }
.chart .hair { stroke: var(--ink); stroke-width: 1; }
.picture svg, .row svg { display: block; width: 100%; height: auto; border-radius: 6px; background: #777; }
.picture { max-width: 780px; }
.row { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(100%, 300px), 1fr)); gap: 12px; }
.row figure { margin: 0; min-width: 0; }
figcaption { font-size: 0.86rem; }
@media (max-width: 480px) { body { padding: 0 12px 24px; } h1 { font-size: 1.4rem; } .mapbox { height: 62vh; } }
@media print { .chooser { position: static; } .buttons { display: none; } }
)css";

}  // namespace cairn::ground
