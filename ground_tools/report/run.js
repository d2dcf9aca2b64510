'use strict';
// What a run of the report's data says, in words.

/* global Page */
/* exported Run */
const Run = (() => {
  const {data, number} = Page;

  const kVerdicts = {
    applied: 'used',
    unfinished: 'not used yet: the search was not done',
    no_map: 'not used: no map',
    no_map_boulders: 'not used: the map has no boulder near',
    no_local_boulders: 'not used: no boulder seen lately',
    too_few_pairs: 'not used: too few pairs of boulders',
    weak_geometry: 'not used: boulders lie too close together to tell the heading',
    iteration_limit: 'not used: the registration did not settle',
    beyond_limit: 'not used: the correction would be implausibly large',
    bad_input: 'not used: bad input',
    late: 'not used: not ready in time',
    inconsistent: 'not used: farther off than the believed uncertainty allows, or the rover slipped',
    no_search_room: 'not used: too many boulders of the map to search among',
    no_hypothesis: 'not used: no pose in reach agrees with the map',
    too_little_evidence: 'not used: unrelated boulders could agree as well',
    ambiguous: 'not used: another pose agrees nearly as well',
    chance_agreement: 'not used: this map agrees as well at wrong poses',
  };
  const kStatuses = {
    vo: {
      first_frame: 'first frame',
      motion: 'motion found',
      bad_image: 'image missing or damaged',
      few_features: 'too few features',
      few_stereo: 'too few left-right matches',
      few_matches: 'too few matches to the frame before',
      no_consensus: 'matches disagree',
      implausible: 'implausible motion',
    },
    boulders: {
      boulders: 'boulders seen',
      no_boulders: 'nothing stands above the ground',
      no_regions: 'no regions',
      no_points: 'no 3D points',
      bad_input: 'bad input',
      running: 'not finished in time',
      idle: 'not looked for',
    },
    fixes: {...kVerdicts, applied: 'used: the pose was corrected'},
    trust: {
      confirmed: 'a fix proved the pose, and every step since was measured',
      claimed: 'the start is as it was told, and no fix has proved it yet',
      coasting: 'held, or moved by motion priors',
      unconfirmed: 'the start was wide, a step was guessed or doubted, or a fix contradicts',
      lost: 'not known where the rover is',
    },
  };

  const status = (kind, name) => (kStatuses[kind] && kStatuses[kind][name]) || name;
  const verdict = (name) => kVerdicts[name] || name;
  const file = (path) => String(path).split('/').filter((part) => part).pop() || '';
  const isUsed = (run, i) => run.fixes.status[i] === 'applied';
  const used = (run) => run.fixes.status.filter((s) => s === 'applied').length;
  const jpeg = (index) => (index >= 0 ? `data:image/jpeg;base64,${data.pictures[index]}` : '');

  const mapWords = (s) => {
    if (!s.map) return 'no map';
    return s.map_pixel_m > 0 ? `${file(s.map)}, ${+ (100 * s.map_pixel_m).toFixed(2)} cm/px` : file(s.map);
  };
  const voWords = (s) => (s.degrade ? `worsened on purpose: ${s.degrade.replace(/,/g, ', ')}` : 'as it is');

  /// Stretches over which the pose was trusted alike.
  function trustSpans(run) {
    const spans = [], f = run.frames;
    f.trust.forEach((name, i) => {
      const last = spans[spans.length - 1], at = f.distance_m[i];
      if (last && last.name === name) {
        last.to = at;
      } else {
        spans.push({name, from: at, to: at, colour: `var(--trust-${name})`});
      }
    });
    return spans;
  }

  function lead(run) {
    const s = run.summary, tries = run.fixes.status.length;
    const fixes = tries === 0 ?
        'No fix was tried.' :
        `${used(run)} of ${tries} tries to correct the position by boulders were used.`;
    if (!run.errors) {
      const unknown = s.forecast ?
          '' :
          ' Nothing here tells how far off these positions are. A forecast of the drive (cairn report ' +
              '--forecast) tells whether so few fixes were to be expected of the right map and start.';
      return `${s.frames} stereo pairs of ${file(s.dataset)}. ${fixes}${unknown}`;
    }
    return `The rover drove ${number(s.path_m, 1)} m and took ${
               s.frames} stereo pairs. By visual odometry alone` +
        `${s.degrade ? ' (worsened on purpose)' : ''} its position in x and y ended ` +
        `${number(s.vo.end_xy_m, 2)} m off; corrected by boulders, ${number(s.corrected.end_xy_m, 2)} m. ${
               fixes}`;
  }

  function errors(run) {
    const s = run.summary;
    if (!run.errors) return '';
    const worse = s.largest_excess_over_vo_m > 0 ?
        'Where VO is still good, a map of limited accuracy can make things worse: by ' +
            `${number(s.largest_excess_over_vo_m, 3)} m at most here.` :
        'It was never worse than VO alone.';
    return 'Each dotted line is a fix that was used. Over the whole drive the corrected position was at ' +
        `most ${number(s.corrected.largest_xy_m, 3)} m off in x and y ` +
        `(VO alone: ${number(s.vo.largest_xy_m, 3)} m). ${worse}`;
  }

  function origin(run) {
    const s = run.summary, map = s.map ? `map ${s.map}` : 'no map';
    return `Run \u201c${run.name}\u201d: ${s.frames} stereo pairs of ${s.dataset}; ${map}; VO ${
               voWords(s)}; ` +
        `mission ${s.mission}, variant ${s.variant}. Written by cairn report.`;
  }

  return {trustSpans, status, verdict, isUsed, used, jpeg, mapWords, voWords, lead, errors, origin};
})();
