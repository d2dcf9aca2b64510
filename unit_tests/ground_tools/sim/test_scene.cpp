// Scenes: defaults, TOML there and back, settings, and every refusal.
#include "sim/scene.hpp"

#include <cstdlib>
#include <map>
#include <sstream>

#include "core/trig.hpp"
#include "ground_tools/scratch.hpp"
#include "sim/traverse.hpp"

using namespace cairn;
using namespace cairn::ground;
using namespace cairn::ground::sim;
using cairn::test::Scratch;

namespace {

const Scratch scratch;
using Sets = std::vector<std::string>;

Scene scene_from(const std::string& text, const Sets& sets = {}) {
  return load_scene(scratch.file("scene.toml", text), sets);
}

/// The text must be refused with each of the words.
void refused(const std::string& text, std::initializer_list<const char*> words) {
  for (const char* word : words) assert_refused(scene_from(text), word);
}
void refused_set(const Sets& sets, std::initializer_list<const char*> words) {
  for (const char* word : words) assert_refused(load_scene({}, sets), word);
}

bool same_rig(const Rig& a, const Rig& b) {
  return a.name == b.name && a.width_px == b.width_px && a.height_px == b.height_px && a.fx_px == b.fx_px &&
         a.fy_px == b.fy_px && a.cx_px == b.cx_px && a.cy_px == b.cy_px && a.baseline_m == b.baseline_m &&
         a.height_m == b.height_m && a.pitch_down_deg == b.pitch_down_deg;
}

void test_defaults_are_the_papers(void**) {
  for (const Scene& s : {load_scene({}), scene_from("")}) {
    assert_int_equal(s.seed, 1);
    assert_true(s.site.origin_y_m == -76.8 && s.site.width_m == 76.8 && s.site.height_m == 76.8);
    assert_true(s.rocks.k == 0.07 && s.sun.elevation_deg == 45.0 && s.ortho_sun.azimuth_deg == 135.0);
    assert_true(same_rig(s.rig, Rig{}));
    assert_true(s.traverse.kind == TraverseKind::kS);
    assert_int_equal(plan(s).size(), 1667);
  }
  assert_string_equal(to_toml(load_scene({})).c_str(), to_toml(Scene{}).c_str());
}

void test_every_key_is_read(void**) {
  static Scene s;
  s = scene_from(
      "seed = 9223372036854775807\n"
      "[site]\norigin_x_m = -5\norigin_y_m = 7.5\nwidth_m = 60\nheight_m = 50.5\nrelief_rms_m = 0.1\n"
      "relief_wavelength_m = 12\nripple_height_m = 0.02\nripple_wavelength_m = 0.3\nripple_azimuth_deg = 10\n"
      "albedo = 0.2\ntexture_contrast = 0.3\npatch_contrast = 0.4\npatch_size_m = 1.5\n"
      "[craters]\nk = 250\nb = 2.5\nmin_diameter_m = 0.5\nmax_diameter_m = 15\ndepth = 0.12\nrim = 0.03\n"
      "min_degradation = 0.25\nmax_degradation = 0.75\n"
      "[rocks]\nk = 0.3\nmin_diameter_m = 0.04\nmax_diameter_m = 1\npebble_min_diameter_m = 0.02\npebbles = "
      "0.5\n"
      "burial = 0.1\nalbedo = 0.3\nalbedo_spread = 0.1\nclear_path = false\nclear_height_m = 0.2\n"
      "clear_distance_m = 0.6\n"
      "[sun]\nelevation_deg = 30\nazimuth_deg = 200\n[ortho_sun]\nelevation_deg = 60\n"
      "[light]\nsky = 0.01\nbackscatter = 0.7\n[ortho_camera]\ngamma = 1\nnoise_dn = 2\nblur_px = 0.6\n"
      "[camera]\nwhite_radiance = 0.5\nnoise_dn = 1\nblur_px = 0.6\nvignetting = 0.1\n"
      "exposure_step_probability = 0.02\nexposure_step_size = 0.2\ndust_spots = 7\n"
      "[rig]\nname = 'custom'\nwidth_px = 640\nheight_px = 480\nfx_px = 500\nfy_px = 501\ncx_px = 320\ncy_px "
      "= 240\n"
      "baseline_m = 0.2\nheight_m = 1.1\npitch_down_deg = 25\n"
      "[traverse]\nkind = 'stop_and_go'\nlength_m = 20\nstep_m = 0.1\nstart_x_m = 5\nstart_y_m = 20\n"
      "start_heading_deg = 30\nmargin_m = 2\nradius_m = -12\nleg_m = 3\nzigzag_deg = 20\nstop_every_m = 2\n"
      "stop_frames = 5\nturn_deg = -30\nturn_step_deg = 1\nslip = 0.05\nslip_sideways = 0.02\n");
  assert_true(s.seed == 9223372036854775807ULL);
  const Site& site = s.site;
  assert_true(site.origin_x_m == -5.0 && site.origin_y_m == 7.5 && site.width_m == 60.0 &&
              site.height_m == 50.5);
  assert_true(site.relief_rms_m == 0.1 && site.relief_wavelength_m == 12.0 && site.ripple_height_m == 0.02);
  assert_true(site.ripple_wavelength_m == 0.3 && site.ripple_azimuth_deg == 10.0 && site.albedo == 0.2);
  assert_true(site.texture_contrast == 0.3 && site.patch_contrast == 0.4 && site.patch_size_m == 1.5);
  const Craters& cr = s.craters;
  assert_true(cr.k == 250.0 && cr.b == 2.5 && cr.min_diameter_m == 0.5 && cr.max_diameter_m == 15.0);
  assert_true(cr.depth == 0.12 && cr.rim == 0.03 && cr.min_degradation == 0.25 && cr.max_degradation == 0.75);
  const Rocks& r = s.rocks;
  assert_true(r.k == 0.3 && r.min_diameter_m == 0.04 && r.max_diameter_m == 1.0);
  assert_true(r.pebble_min_diameter_m == 0.02 && r.pebbles == 0.5 && r.burial == 0.1 && r.albedo == 0.3);
  assert_true(r.albedo_spread == 0.1 && !r.clear_path && r.clear_height_m == 0.2 &&
              r.clear_distance_m == 0.6);
  assert_true(s.sun.elevation_deg == 30.0 && s.sun.azimuth_deg == 200.0);
  assert_true(s.ortho_sun.elevation_deg == 60.0 && s.ortho_sun.azimuth_deg == 200.0);  // as [sun]
  assert_true(s.light.sky == 0.01 && s.light.backscatter == 0.7);
  const OrthoCamera& o = s.ortho_camera;
  assert_true(o.gamma == 1.0 && o.noise_dn == 2.0 && o.blur_px == 0.6);
  const Camera& c = s.camera;
  assert_true(c.white_radiance == 0.5 && c.noise_dn == 1.0 && c.blur_px == 0.6 && c.vignetting == 0.1);
  assert_true(c.exposure_step_probability == 0.02 && c.exposure_step_size == 0.2 && c.dust_spots == 7);
  assert_true(same_rig(s.rig, {"custom", 640, 480, 500.0, 501.0, 320.0, 240.0, 0.2, 1.1, 25.0}));
  const Traverse& t = s.traverse;
  assert_true(t.kind == TraverseKind::kStopAndGo && t.length_m == 20.0 && t.step_m == 0.1);
  assert_true(*t.start_x_m == 5.0 && *t.start_y_m == 20.0 && t.start_heading_deg == 30.0 &&
              t.margin_m == 2.0);
  assert_true(t.radius_m == -12.0 && t.leg_m == 3.0 && t.zigzag_deg == 20.0 && t.stop_every_m == 2.0);
  assert_true(t.stop_frames == 5 && t.turn_deg == -30.0 && t.turn_step_deg == 1.0);
  assert_true(t.slip == 0.05 && t.slip_sideways == 0.02);

  // There and back, to the last bit: the text has every digit.
  static std::string record;
  record = to_toml(s);
  static Scene again;
  again = scene_from(record);
  assert_string_equal(to_toml(again).c_str(), record.c_str());
  assert_true(again.seed == s.seed && again.traverse.slip == s.traverse.slip && same_rig(again.rig, s.rig));
}

void test_record_of_every_kind_and_rig(void**) {
  for (const char* kind : {"s", "arc", "zigzag", "stop_and_go", "point_turn", "straight"}) {
    for (const char* rig : {"paper", "mast"}) {
      static Scene s;
      s = load_scene({}, {std::string("traverse.kind=") + kind, std::string("rig.name=") + rig,
                          "traverse.length_m=23.7", "seed=77", "sun.elevation_deg=33.3"});
      assert_string_equal(name_of(s.traverse.kind), kind);
      static Scene again;
      again = scene_from(to_toml(s));
      assert_string_equal(to_toml(again).c_str(), to_toml(s).c_str());
      assert_true(same_rig(again.rig, s.rig));
      assert_string_equal(again.rig.name.c_str(), rig);
      assert_int_equal(plan(again).size(), plan(s).size());
      assert_true(plan(again).back().x_m == plan(s).back().x_m);
    }
  }
}

std::vector<std::string> cells_of(const std::string& row) {
  std::vector<std::string> cells;
  std::istringstream in(row);
  for (std::string cell; std::getline(in, cell, '|');) {
    const std::size_t first = cell.find_first_not_of(" *`");
    cells.push_back(
        first == std::string::npos ? "" : cell.substr(first, cell.find_last_not_of(" *`") - first + 1));
  }
  return cells;
}

/// Rows of the guide's tables that tell one key's default must tell the one that is.
void test_the_guide_tells_the_defaults(void**) {
  std::map<std::string, std::string> defaults;
  std::istringstream record(to_toml(Scene{}));
  std::string section;
  for (std::string line; std::getline(record, line);) {
    if (!line.empty() && line[0] == '[') section = line;
    const std::size_t equals = line.find(" = ");
    if (equals != std::string::npos) defaults[section + line.substr(0, equals)] = line.substr(equals + 3);
  }
  std::ifstream guide(std::filesystem::path(CAIRN_SOURCE_DIR) / "doc" / "guide" / "simulator.md");
  section.clear();
  int compared = 0;
  for (std::string line; std::getline(guide, line);) {
    const std::vector<std::string> cells = cells_of(line);
    if (cells.size() < 5) continue;
    if (cells[1][0] == '[') section = cells[1];
    const auto known = defaults.find(section + cells[1]);
    char* end = nullptr;
    const double told = std::strtod(cells[3].c_str(), &end);
    if (known == defaults.end() || end == cells[3].c_str()) continue;
    const double is = std::strtod(known->second.c_str(), nullptr);
    if (std::fabs(told - is) > 1.0e-3 * std::fabs(is)) {
      fail_msg("%s%s: the guide tells %s, it is %s", section.c_str(), cells[1].c_str(), cells[3].c_str(),
               known->second.c_str());
    }
    ++compared;
  }
  assert_at_least(compared, 45);
}

void test_shipped_scenes(void**) {
  static std::filesystem::path folder;
  folder = std::filesystem::path(CAIRN_SOURCE_DIR) / "mission_cfg" / "scenes";
  int scenes = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() != ".toml") continue;
    static Scene s;
    s = load_scene(entry.path());
    assert_at_least(plan(s).size(), 100.0);
    ++scenes;
  }
  assert_at_least(scenes, 3);
  assert_string_equal(to_toml(load_scene(folder / "paper.toml")).c_str(), to_toml(Scene{}).c_str());
  assert_string_equal(load_scene(folder / "mast.toml").rig.name.c_str(), "mast");
}

void test_settings_replace(void**) {
  static Scene s;
  s = scene_from("seed = 4\n[traverse]\nlength_m = 50\nkind = 's'\n[sun]\nazimuth_deg = 10\n",
                 {"traverse.length_m=20", "traverse.kind=straight", "rocks.clear_path=false",
                  "traverse.length_m = 21.5", "ortho_sun.elevation_deg=70"});
  assert_int_equal(s.seed, 4);
  assert_true(s.traverse.length_m == 21.5 && s.traverse.kind == TraverseKind::kStraight);
  assert_true(!s.rocks.clear_path && s.sun.azimuth_deg == 10.0);
  assert_true(s.ortho_sun.azimuth_deg == 10.0 && s.ortho_sun.elevation_deg == 70.0);
  // A quoted text, and a section in one go.
  s = load_scene({}, {"traverse.kind=\"arc\"", "sun={elevation_deg=20, azimuth_deg=30}"});
  assert_true(s.traverse.kind == TraverseKind::kArc && s.sun.azimuth_deg == 30.0);
}

void test_site_sides(void**) {
  static Scene s;
  s = scene_from("[site]\nsize_m = 90\n");
  assert_true(s.site.width_m == 90.0 && s.site.height_m == 90.0 && s.site.origin_y_m == -90.0);
  s = scene_from("[site]\nsize_m = 90\n", {"site.width_m=100"});
  assert_true(s.site.width_m == 100.0 && s.site.height_m == 90.0);
  s = scene_from("[site]\nwidth_m = 90\nheight_m=80\norigin_y_m = 3\n", {"site.size_m=100"});
  assert_true(s.site.width_m == 100.0 && s.site.height_m == 100.0 && s.site.origin_y_m == 3.0);
  refused("[site]\nsize_m = 90\nheight_m = 80\n", {"scene.toml:2: site.size_m", "remove one"});
  refused("[site]\nsize_m = 0\n", {"site.size_m = 0 is out of range"});
}

void test_rigs(void**) {
  static Scene s;
  s = load_scene({}, {"rig.name=mast", "traverse.length_m=50"});
  const StereoRig mast = stereo_rig(s.rig);
  assert_true(is_valid(mast));
  assert_int_equal(mast.width_px, 1024);
  assert_near(2.0 * std::atan(512.0 / mast.fx_px) * kDegPerRad, 66.0, 1.0e-6);
  assert_near(2.0 * std::atan(384.0 / mast.fy_px) * kDegPerRad, 51.9, 0.1);
  assert_near(mast.T_rover_cam.t.z(), 2.0, 0.0);
  assert_near(mast.T_rover_cam.t.y(), 0.2, 0.0);
  assert_near((mast.T_rover_cam.q * Vec3(0.0, 0.0, 1.0)).z(), -std::sin(20.0 * kRadPerDeg), 1.0e-12);

  // One number replaced makes it custom, the others stay.
  s = load_scene({}, {"rig.height_m=1.0"});
  assert_string_equal(s.rig.name.c_str(), "custom");
  assert_true(s.rig.height_m == 1.0 && s.rig.fx_px == 394.205430737);
  // Field of view and size; the centre follows the size.
  s = scene_from("[rig]\nwidth_px = 800\nheight_px = 600\nhfov_deg = 90\n");
  assert_near(s.rig.fx_px, 400.0, 1.0e-9);
  assert_true(s.rig.fy_px == s.rig.fx_px && s.rig.cx_px == 399.5 && s.rig.cy_px == 299.5);
  s = scene_from("[rig]\nwidth_px = 800\nheight_px = 600\nfx_px = 450\ncx_px = 390\n");
  assert_true(s.rig.fx_px == 450.0 && s.rig.fy_px == 450.0 && s.rig.cx_px == 390.0 && s.rig.cy_px == 299.5);
  s = scene_from("[rig]\nfy_px = 380\n");
  assert_true(s.rig.fx_px == 394.205430737 && s.rig.fy_px == 380.0);
  // On the command line: a later field of view replaces an earlier focal length, a name the whole rig.
  s = scene_from("[rig]\nfx_px = 450\nfy_px = 460\n", {"rig.hfov_deg=90"});
  assert_near(s.rig.fx_px, 256.0, 1.0e-9);
  assert_true(s.rig.fy_px == s.rig.fx_px && s.rig.cx_px == 255.5);
  static std::string record;
  record = to_toml(s);
  s = scene_from(record, {"rig.name=mast", "traverse.length_m=50"});
  assert_string_equal(s.rig.name.c_str(), "mast");
  s = scene_from(record, {"rig.name=paper"});
  assert_true(same_rig(s.rig, Rig{}));
}

void test_sun_direction(void**) {
  const Vec3 south_east = sun_direction({45.0, 135.0});
  assert_near((south_east - Vec3(0.5, -0.5, std::sqrt(0.5))).norm(), 0.0, 1.0e-12);
  assert_near((sun_direction({90.0, 20.0}) - Vec3(0.0, 0.0, 1.0)).norm(), 0.0, 1.0e-12);
  assert_near((sun_direction({30.0, 90.0}) - Vec3(std::sqrt(0.75), 0.0, 0.5)).norm(), 0.0, 1.0e-12);
}

void test_waypoints(void**) {
  scratch.file("way/points.csv", "x,y\n10,-10\n20,-10\n20,-20\n");
  scratch.file("way/scene.toml", "[traverse]\nkind = 'waypoints'\nwaypoints = 'points.csv'\n");
  static Scene s;
  s = load_scene(scratch.path("way/scene.toml"));
  assert_int_equal(s.traverse.waypoints_map_m.size(), 3);
  assert_near((s.traverse.waypoints_map_m[2] - Vec2(20.0, -20.0)).norm(), 0.0, 0.0);
  // The record needs no other file.
  static std::string record;
  record = to_toml(s);
  static Scene again;
  again = scene_from(record);
  assert_string_equal(to_toml(again).c_str(), record.c_str());
  assert_true(plan(again).back().x_m == plan(s).back().x_m);
  // Another kind on the command line passes over the points; and the other way round.
  s = load_scene(scratch.path("way/scene.toml"), {"traverse.kind=s", "traverse.length_m=30"});
  assert_true(s.traverse.waypoints_map_m.empty());
  s = scene_from("[traverse]\nlength_m = 30\nstart_x_m = 30\nstart_y_m = -30\n",
                 {"traverse.kind=waypoints", "traverse.waypoints=[[10, -10], [12.5, -10]]"});
  assert_int_equal(s.traverse.waypoints_map_m.size(), 2);

  const std::string kind = "[traverse]\nkind = 'waypoints'\n";
  refused(kind, {"scene.toml:2: traverse.waypoints is missing", "CSV"});
  refused(kind + "waypoints = 'absent.csv'\n", {"absent.csv"});
  refused(kind + "waypoints = 3\n", {"scene.toml:3: traverse.waypoints is a number; it must be"});
  refused(kind + "waypoints = [[1, -10]]\n", {"has 1 points"});
  refused(kind + "waypoints = [[10, -10], [10]]\n", {"pairs of numbers"});
  refused(kind + "waypoints = [[10, -10], ['a', 2]]\n", {"pairs of numbers"});
  refused(kind + "waypoints = [[10, -10], [10, -10]]\n", {"points 1 and 2 are the same"});
  refused(kind + "waypoints = [[10, -10], [nan, -10]]\n", {"point 2 is out of range"});
  refused(kind + "waypoints = [[10, -10], [90, -10]]\n",
          {"scene.toml:3: traverse.waypoints leads out of the site"});
  refused(kind + "waypoints = [[10, -10], [20, -10]]\nlength_m = 5\n",
          {"scene.toml:4: traverse.length_m", "remove it"});
  refused("[traverse]\nwaypoints = [[10, -10], [20, -10]]\n", {"cannot be combined with kind = 's'"});
  scratch.file("bad.csv", "x,y\n10,-10\n20,b\n");
  refused(kind + "waypoints = 'bad.csv'\n", {"bad.csv:3"});
  scratch.file("columns.csv", "a,b\n10,-10\n");
  refused(kind + "waypoints = 'columns.csv'\n", {"columns.csv", "no column 'x_m' or 'x'"});
}

void test_refuses_what_is_no_scene(void**) {
  assert_refused(load_scene(scratch.path("none.toml")), "none.toml");
  assert_refused(load_scene(scratch.path("folder/x").parent_path()), "folder");
  refused("[site\n", {"scene.toml:1: not TOML"});
  refused("seed = 1\nseed = 2\n", {"scene.toml:2: not TOML"});
  refused("seed = 1\n\n[rocks]\nk = 0.1.2\n", {"scene.toml:4: not TOML"});
  refused(std::string("seed = \"\x01\xff\"\n"), {"scene.toml:1: not TOML"});
}

void test_refuses_unknown_keys(void**) {
  refused("sed = 1\n", {"scene.toml:1: no key or section 'sed'", "[traverse]"});
  refused("[rock]\nk = 0.1\n", {"scene.toml:1: no key or section 'rock'"});
  refused("[rocks]\nk = 0.1\nmin_diameter = 0.1\n",
          {"scene.toml:3: no key 'rocks.min_diameter'", "min_diameter_m"});
  refused("[traverse]\nlenght_m = 10\n", {"scene.toml:2: no key 'traverse.lenght_m'", "length_m"});
  refused("[ortho_sun]\naltitude = 10\n", {"no key 'ortho_sun.altitude'", "elevation_deg"});
  refused("site = 3\n", {"scene.toml:1: site is a number; it must be a section"});
  refused("\"\" = 3\n", {"no key or section ''"});
  refused("\"a\\nb\" = 3\n", {"no key or section 'a b'"});
  refused_set({"rocks.kk=3"}, {"--set rocks.kk=3: no key 'rocks.kk'"});
  refused_set({"k=3"}, {"--set k=3: no key or section 'k'"});
}

void test_refuses_wrong_types(void**) {
  refused("seed = 1.5\n", {"scene.toml:1: seed is a number; it must be a whole number"});
  refused("seed = -1\n", {"seed = -1 is out of range"});
  refused("seed = 9223372036854775808\n", {"not TOML"});
  refused("[seed]\na = 1\n", {"seed is a section"});
  refused("[rocks]\nk = '0.1'\n", {"scene.toml:2: rocks.k is text; it must be a number"});
  refused("[rocks]\nk = true\n", {"rocks.k is true or false; it must be a number"});
  refused("[rocks]\nk = [0.1]\n", {"rocks.k is a list"});
  refused("[rocks]\nk = 1979-05-27\n", {"rocks.k is a date"});
  refused("[rocks]\nclear_path = 1\n", {"rocks.clear_path is a number; it must be true or false"});
  refused("[camera]\ndust_spots = 2.0\n", {"camera.dust_spots is a number; it must be a whole number"});
  refused("[rig]\nname = 3\n", {"rig.name is a number; it must be text"});
  refused("[traverse]\nkind = true\n", {"traverse.kind is true or false; it must be text"});
}

void test_refuses_what_is_out_of_range(void**) {
  // Each number at both of its ends: inside is taken, outside and NaN refused.
  const struct {
    const char* key;
    double low;
    double high;
  } keys[] = {{"rocks.k", 0.0, 0.30},
              {"light.sky", 0.0, 1.0},
              {"light.backscatter", 0.0, 1.0},
              {"ortho_camera.gamma", 0.2, 2.0},
              {"ortho_camera.noise_dn", 0.0, 20.0},
              {"ortho_camera.blur_px", 0.1, 1.0},
              {"craters.k", 0.0, 1.0e5},
              {"craters.depth", 0.0, 0.4},
              {"craters.rim", 0.0, 0.1},
              {"craters.max_degradation", 0.0, 1.0},
              {"sun.elevation_deg", 5.0, 90.0},
              {"ortho_sun.azimuth_deg", 0.0, 360.0},
              {"camera.noise_dn", 0.0, 50.0},
              {"camera.blur_px", 0.0, 5.0},
              {"camera.vignetting", 0.0, 0.9},
              {"camera.exposure_step_probability", 0.0, 1.0},
              {"camera.exposure_step_size", 0.0, 0.9},
              {"camera.white_radiance", 0.01, 10.0},
              {"site.albedo", 0.02, 0.9},
              {"site.relief_rms_m", 0.0, 10.0},
              {"site.ripple_height_m", 0.0, 0.5},
              {"site.texture_contrast", 0.0, 1.0},
              {"rocks.burial", 0.0, 0.9},
              {"rocks.pebbles", 0.0, 5.0},
              {"traverse.slip", 0.0, 0.5},
              {"traverse.slip_sideways", 0.0, 0.5},
              {"traverse.turn_step_deg", 0.05, 2.0}};
  for (const auto& k : keys) {
    // Far slips and long ways may leave the site; a short drive does not.
    const auto with = [&k](const std::string& value) {
      return Sets{std::string(k.key) + "=" + value, "traverse.length_m=5"};
    };
    static_cast<void>(load_scene({}, with(fmt::format("{}", k.low))));
    static_cast<void>(load_scene({}, with(fmt::format("{}", k.high))));
    for (const std::string& bad : {fmt::format("{}", k.low - 0.001), fmt::format("{}", k.high + 0.001),
                                   std::string("nan"), std::string("inf"), std::string("-inf")}) {
      refused_set(with(bad), {k.key, "is out of range"});
    }
  }
  refused("[rocks]\nk = 0.5\n", {"scene.toml:2: rocks.k = 0.5 is out of range; use 0 to 0.3"});
  refused("[camera]\ndust_spots = -1\n", {"camera.dust_spots = -1 is out of range; use 0 to 500"});
  refused("[rocks]\nk = 0.001\n", {"scene.toml:2: rocks.k = 0.001", "or 0 for no rocks"});
  refused("[craters]\nk = 1e5\nmin_diameter_m = 0.2\n",
          {"scene.toml:2: craters.k", "14", "raise min_diameter_m"});
  refused("[craters]\nmin_diameter_m = 20\n", {"scene.toml:2: craters.min_diameter_m", "is not below"});
  refused("[craters]\nmax_degradation = 0.2\nmin_degradation = 0.3\n",
          {"craters.min_degradation = 0.3 is above max_degradation = 0.2"});
  refused("[rocks]\nmax_diameter_m = 0.05\n", {"rocks.min_diameter_m", "is not below"});
  refused("[rocks]\npebble_min_diameter_m = 0.1\n", {"pebble_min_diameter_m = 0.1 is above"});
  static_cast<void>(scene_from("[rocks]\npebble_min_diameter_m = 0.1\npebbles = 0\n"));
}

void test_refuses_impossible_rigs(void**) {
  refused("[rig]\nname = 'moon'\n", {"scene.toml:2: rig.name = 'moon' is not a known rig; use paper, mast"});
  refused("[rig]\nname = 'custom'\nwidth_px = 100\n",
          {"rig.name = 'custom' needs every number; add height_px"});
  refused("[rig]\nwidth_px = 0\n", {"rig.width_px = 0 is out of range"});
  refused("[rig]\nbaseline_m = 0\n", {"rig.baseline_m = 0 is out of range"});
  refused("[rig]\nheight_m = 0\n", {"rig.height_m = 0 is out of range"});
  refused("[rig]\nfx_px = -5\n", {"rig.fx_px = -5 is out of range"});
  refused("[rig]\nwidth_px = 1024\n", {"scene.toml:2: rig.width_px is given without a focal length"});
  refused("[rig]\nheight_px = 1024\n", {"without a focal length"});
  refused("[rig]\nhfov_deg = 60\nfx_px = 500\n", {"rig.hfov_deg cannot be combined with fx_px"});
  refused("[rig]\nhfov_deg = 180\n", {"rig.hfov_deg = 180 is out of range"});
  refused("[rig]\npitch_down_deg = -30\n",
          {"scene.toml:2: rig.pitch_down_deg = -30: the cameras see no ground"});
  refused("[rig]\nheight_m = 0.1\npitch_down_deg = 80\nbaseline_m = 2\n",
          {"scene.toml:4: rig.baseline_m = 2: the images hardly overlap"});
  refused("[rig]\nbaseline_m = 0.005\nheight_m = 5\n", {"too short for depth"});
  refused("[rig]\ncx_px = 600\n", {"rig.cx_px = 600, cy_px = 191.5: outside of the image"});
  // Level cameras see ground below the horizon; straight down is a rig, too.
  static_cast<void>(scene_from("[rig]\npitch_down_deg = 0\n"));
  static_cast<void>(scene_from("[rig]\npitch_down_deg = 90\n"));
}

void test_refuses_impossible_traverses(void**) {
  refused("[traverse]\nkind = 'spiral'\n",
          {"scene.toml:2: traverse.kind = 'spiral' is not a known kind", "stop_and_go"});
  refused("[traverse]\nlength_m = 0\n", {"scene.toml:2: traverse.length_m = 0 is too short"});
  refused("[traverse]\nlength_m = 0.05\n", {"too short for steps of 0.06 m"});
  refused("[traverse]\nlength_m = -1\n", {"out of range"});
  refused("[traverse]\nstep_m = 0\n", {"traverse.step_m = 0 is out of range"});
  refused("[traverse]\nlength_m = 9000\nstep_m = 0.001\n",
          {"scene.toml:3: traverse.step_m = 0.001: 9000000 frames"});
  refused("[traverse]\nradius_m = 0.1\n", {"traverse.radius_m = 0.1 is too tight"});
  refused("[traverse]\nstart_x_m = 3\n", {"start_y_m must be given together"});
  refused("[traverse]\nstart_y_m = 3\n", {"scene.toml:2", "must be given together"});
  refused("[traverse]\nkind = 'straight'\n",
          {"scene.toml:2: traverse.length_m leads out of the site", "enlarge [site]"});
  refused("[traverse]\nkind = 'straight'\nlength_m = 70\n",
          {"to the edge of the site", "margin_m requires 4"});
  static_cast<void>(scene_from("[traverse]\nkind = 'straight'\nlength_m = 68.8\nstep_m = 0.1\n"));
  refused("[site]\nsize_m = 20\n", {"scene.toml: traverse.length_m leads out of the site"});
  refused("[traverse]\nlength_m = 20\nstart_x_m = 500\nstart_y_m = -10\n",
          {"leads out of the site: frame 83 at (503.18"});
  // Slip counts: what fits as commanded may go astray.
  const Sets narrow = {"traverse.kind=straight", "traverse.length_m=60", "site.height_m=8.01"};
  static_cast<void>(load_scene({}, narrow));
  Sets slipping = narrow;
  slipping.push_back("traverse.slip_sideways=0.5");
  refused_set(slipping, {"to the edge of the site"});
  refused_set({"traverse.kind=point_turn", "traverse.length_m=0", "traverse.turn_deg=0"},
              {"is too short for steps"});
  static_cast<void>(load_scene({}, {"traverse.kind=point_turn", "traverse.length_m=0"}));
}

void test_refuses_bad_settings(void**) {
  refused_set({"traverse.length_m"}, {"--set traverse.length_m: expected section.key=value"});
  refused_set({"=3"}, {"expected section.key=value"});
  refused_set({"a.b=1\nc.d=2"}, {"expected section.key=value"});
  refused_set({"traverse..x=1"}, {"not TOML"});
  refused_set({"rocks.k=it's"}, {"not TOML"});
  refused_set({"rocks.k=much"}, {"--set rocks.k=much: rocks.k is text; it must be a number"});
  refused_set({"rocks.k=0.5"}, {"--set rocks.k=0.5: rocks.k = 0.5 is out of range"});
  refused_set({"rocks=0.5"}, {"--set rocks=0.5: rocks is a number; it must be a section"});
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_defaults_are_the_papers),
      cmocka_unit_test(test_every_key_is_read),
      cmocka_unit_test(test_record_of_every_kind_and_rig),
      cmocka_unit_test(test_the_guide_tells_the_defaults),
      cmocka_unit_test(test_shipped_scenes),
      cmocka_unit_test(test_settings_replace),
      cmocka_unit_test(test_site_sides),
      cmocka_unit_test(test_rigs),
      cmocka_unit_test(test_sun_direction),
      cmocka_unit_test(test_waypoints),
      cmocka_unit_test(test_refuses_what_is_no_scene),
      cmocka_unit_test(test_refuses_unknown_keys),
      cmocka_unit_test(test_refuses_wrong_types),
      cmocka_unit_test(test_refuses_what_is_out_of_range),
      cmocka_unit_test(test_refuses_impossible_rigs),
      cmocka_unit_test(test_refuses_impossible_traverses),
      cmocka_unit_test(test_refuses_bad_settings),
  };
  return cmocka_run_group_tests_name("ground_tools/sim/scene", tests, nullptr, nullptr);
}
