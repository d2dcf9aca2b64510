#include "report/page.hpp"

namespace cairn::ground {

const char* const kPageBody = R"html(<header>
<h1>Cairn: where was the rover?</h1>
<p id="lead" class="lead"></p>
<noscript><p class="note">This page draws its figures with its own script; please allow scripts for it. It loads nothing
from anywhere.</p></noscript>
</header>
<main>
<section>
<h2>What came out</h2>
<p>A rover knows how it moved by comparing pictures of its two cameras (<em>visual odometry</em>, VO). Small errors of each
step add up. Cairn looks for boulders around the rover, finds the same ones on a map made from orbit, and so takes the error
away again: a <em>fix</em>. The table holds what was left of it, against the true path where that is known.</p>
<div class="scroll" tabindex="0" role="region" aria-label="Table of runs"><table id="runs"></table></div>
<p class="small">Position errors in metres, angles in degrees. &ldquo;End&rdquo; is the last frame; &ldquo;largest&rdquo; is the worst
moment of the drive in x and y. The map is flat: fixes correct x, y and the heading (yaw), while height and tilt stay as VO has them;
so the whole 3D error and the whole rotation stand beside them.</p>
<div id="together" hidden>
<h3>All runs together</h3>
<div class="charts" id="all-charts"></div>
</div>
</section>
<div id="chooser" class="chooser" hidden><label for="run">Shown below</label> <select id="run"></select></div>
<section>
<h2>The drive from above</h2>
<p>North is up. Three lines: where the rover truly went, where VO alone believed it was, and where Cairn put it. Where they
seem to be one line, zoom in. Rings are boulders of the orbital map, discs are those that the rover found; a disc in a ring is
a boulder known to both.</p>
<div id="layers" class="layers" role="group" aria-label="Layers of the map"></div>
<div class="mapbox" id="mapbox">
<canvas id="map" tabindex="0" role="application" aria-label="Map of the drive. Arrow keys move, plus and minus zoom, 0 shows all, N and P go from fix to fix." aria-describedby="map-tip"></canvas>
<div class="buttons"><button type="button" id="zoom-in" aria-label="Zoom in">+</button><button type="button" id="zoom-out" aria-label="Zoom out">&minus;</button><button type="button" id="zoom-all">All</button></div>
<div id="map-tip" class="tip" role="status" aria-live="polite" hidden></div>
</div>
<p class="small"><span id="map-shown"></span> Drag to move; wheel, pinch or buttons to zoom. Keys: arrows, + and &minus;,
0 for all, N and P from fix to fix. Point at a thing to learn what it is.</p>
</section>
<section>
<h2>Errors over the distance</h2>
<p id="errors-words"></p>
<div class="charts" id="charts"></div>
</section>
<section>
<h2>What the rover saw</h2>
<div id="no-strips" class="note" hidden>This run kept no pictures (<code>--pictures 0</code>, or no frame).</div>
<div id="strips">
<p>Some frames of the drive, evenly chosen.</p>
<div id="strip-buttons" class="tabs" role="group" aria-label="Frame"></div>
<h3>1. Cutting the image into regions</h3>
<p>The left image is cut into regions of like brightness (tinted). A region may be a boulder, a shadow or a patch of sand. Its 3D
points from the stereo pair decide: a <b>bold outline</b> marks a region that stands above the ground around it, a
boulder.</p>
<div class="layers"><label><input type="checkbox" id="show-regions" checked> regions</label><label><input type="checkbox" id="show-points"> raised 3D points</label></div>
<div id="regions" class="picture"></div>
<h3>2. Following labels over time</h3>
<p id="strip-words"></p>
<div id="labels" class="row"></div>
<h3>3. From points to boulders</h3>
<p>The raised 3D points seen from above, on the orbital image, north up. Left: coloured by the region that each was seen in; grey ones lie
in no region. Right: after grouping by distance, one colour a boulder; grey groups are
too small to count, or hold no region. White circles are the boulders as they go
to the local map; yellow rings are boulders of the orbital map, and the triangle is the camera. On a good fix circles and rings coincide.</p>
<div id="clusters" class="row"></div>
</div>
</section>
<section>
<h2>Every fix</h2>
<p>Every so often the boulders seen lately are laid over those of the map. Only a fix that is <b>used</b> moves the rover; the
others say why not, and a few of them are no fault. &ldquo;Remains&rdquo; is the distance left between paired boulders (root mean
square), &ldquo;sigma&rdquo; how well the position is then believed to be known.</p>
<div class="scroll" tabindex="0" role="region" aria-label="Table of fixes"><table id="fixes"></table></div>
</section>
<section>
<h2>Time and work</h2>
<p>Work is counted in operations (about one multiply-add each), the same on every machine; milliseconds are those of the machine
that ran this. Registration runs in a few frames before each fix only.</p>
<div class="scroll" tabindex="0" role="region" aria-label="Table of work"><table id="work"></table></div>
<div class="charts" id="work-charts"></div>
<h3>Memory</h3>
<p>All memory of the flight module is fixed when it is built.</p>
<div class="scroll" tabindex="0" role="region" aria-label="Table of memory"><table id="memory"></table></div>
<h3>What became of the frames</h3>
<div class="scroll" tabindex="0" role="region" aria-label="Table of statuses"><table id="counts"></table></div>
</section>
</main>
<footer><p class="small" id="origin"></p></footer>
)html";

}  // namespace cairn::ground
