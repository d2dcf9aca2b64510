// What the whole module says of its pose while a drive's pairs are spoilt: a table, one row a fault. Held
// against truth in each frame: is the error within three of the sigmas reported, does trust tell, and is the
// pose right again after the next good fix?
//
// The data set at FOLDER has truth and true rocks, whose map is used; WORDs choose rows by name. Exit
// status 1 where an error left its three sigmas.
//
// usage: fault_table FOLDER [WORD...]
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "app/flight_app.hpp"
#include "base/boulder_table.hpp"
#include "cmap/cmap_file.hpp"
#include "core/random.hpp"
#include "dataset/dataset.hpp"
#include "platform/host/host_hal.hpp"
#include "replay/replay.hpp"
#include "replay/status_names.hpp"

using namespace cairn;

namespace {

constexpr std::size_t kBefore = 75;  // good pairs: two fixes
constexpr std::size_t kAfter = 95;   // three
constexpr double kSigmaXy_m = 0.02;
constexpr double kSigmaYaw_rad = 0.004;
constexpr double kSlip = 1.05;  // of what motion priors tell

/// What the lower part of every picture shows from the fault on.
enum class Hardware { kNone, kDeck, kPlate };

/// A pair as it is delivered; kDark for a side that is black.
struct Delivery {
  static constexpr std::size_t kDark = SIZE_MAX;
  std::size_t number = 0;  ///< and time
  std::size_t left = 0;
  std::size_t right = 0;
};

struct Fault {
  std::string name;
  std::size_t length = 0;  ///< pairs between the good ones before and those after
  std::function<std::vector<Delivery>(std::size_t)> deliver;  ///< what comes in place of pair i
  bool priors = false;
  Hardware hardware = Hardware::kNone;
  double share = 0.0;  ///< of the picture's rows that it covers, the lower ones
  bool masked = false;
};

std::vector<Delivery> as_it_is(std::size_t i) { return {{i, i, i}}; }
bool in_fault(std::size_t i, std::size_t length) { return i >= kBefore && i < kBefore + length; }

std::vector<Fault> faults() {
  std::vector<Fault> all;
  const auto add = [&](const std::string& name, std::size_t length, bool both,
                       const std::function<std::vector<Delivery>(std::size_t)>& spoilt) {
    const auto deliver = [=](std::size_t i) { return in_fault(i, length) ? spoilt(i) : as_it_is(i); };
    all.push_back({name, length, deliver, false, Hardware::kNone, 0.0, false});
    if (both) all.push_back({name + ", with priors", length, deliver, true, Hardware::kNone, 0.0, false});
  };
  using List = std::vector<Delivery>;
  add("none", 0, true, as_it_is);
  for (const std::size_t n : {9, 25, 100}) {
    add(fmt::format("{} dark pairs", n), n, true, [](std::size_t i) {
      return List{{i, Delivery::kDark, Delivery::kDark}};
    });
  }
  add("8 pairs never come", 8, true, [](std::size_t) { return List(); });
  add("12 times the same pair", 12, true, [](std::size_t i) { return List{{i, kBefore - 1, kBefore - 1}}; });
  add("12 right images a frame late", 12, true, [](std::size_t i) { return List{{i, i, i - 1}}; });
  add("12 right images missing", 12, true, [](std::size_t i) { return List{{i, i, Delivery::kDark}}; });
  add("12 pairs left and right swapped", 12, true, [](std::size_t i) { return List{{i, i, i}}; });
  add("12 pairs twice", 12, false, [](std::size_t i) { return List{{i, i, i}, {i, i, i}}; });
  add("12 pairs, after each that of 5 before", 12, false, [](std::size_t i) {
    return List{{i, i, i}, {i - 5, i - 5, i - 5}};
  });
  add("12 pairs two by two in the wrong order", 12, false, [](std::size_t i) {
    return (i - kBefore) % 2 == 0 ? List() : List{{i, i, i}, {i - 1, i - 1, i - 1}};
  });
  for (const double share : {0.4, 0.7, 0.85}) {
    for (const Hardware what : {Hardware::kDeck, Hardware::kPlate}) {
      for (const bool masked : {false, true}) {
        for (const bool priors : {false, true}) {
          if (masked && priors) continue;
          const std::string name = what == Hardware::kDeck ? "deck" : "plate";
          all.push_back({fmt::format("{} over {:.0f} %{}{}", name, 100.0 * share, masked ? ", masked" : "",
                                     priors ? ", with priors" : ""),
                         30, as_it_is, priors, what, share, masked});
        }
      }
    }
  }
  return all;
}

/// A plate near the camera, square upon square, 40 pixels farther left in the right image.
std::uint8_t plate(std::size_t u, std::size_t v, bool right) {
  const std::size_t column = (u + (right ? 40U : 0U)) / 8;
  Random random(1000 * (v / 8) + column);
  return static_cast<std::uint8_t>(30 + random.below(200));
}

host::Picture picture(const ground::Dataset& data, const Fault& fault, std::size_t i, bool right) {
  const ground::Frame& first = data.frames()[0];
  const bool dark = i == Delivery::kDark;
  const ground::Frame& frame = data.frames()[dark ? 0 : i];
  ground::Image image = ground::load_grey(right ? frame.right : frame.left);
  if (dark) std::fill(image.pixels.begin(), image.pixels.end(), std::uint8_t{0});
  if (fault.hardware != Hardware::kNone && !dark) {
    static const ground::Image own[2] = {ground::load_grey(first.left), ground::load_grey(first.right)};
    const auto width = static_cast<std::size_t>(image.width);
    const auto from = static_cast<std::size_t>((1.0 - fault.share) * image.height) * width;
    for (std::size_t k = from; k < image.pixels.size(); ++k)
      image.pixels[k] = fault.hardware == Hardware::kDeck ? own[right ? 1 : 0].pixels[k]
                                                          : plate(k % width, k / width, right);
  }
  return {image.width, image.height, std::move(image.pixels)};
}

void command(app::Command content) {
  static std::uint32_t sequence = 0;
  content.sequence = ++sequence;
  app::Packet packet;
  app::encode(content, packet);
  host::feed_telecommand(std::vector<std::uint8_t>(packet.begin(), packet.end()));
}

void run_until_idle() {
  while (app::root.cycle() == app::FlightApp::State::kBusy) {
  }
}

/// What is said, in order, each once in a row: 'confirmed 74, coasting 9, ...'.
class Said {
 public:
  void add(const std::string& word) {
    if (words_.empty() || words_.back().first != word) words_.push_back({word, 0});
    ++words_.back().second;
  }
  std::string text() const {
    std::string all;
    std::size_t shown = 0;
    for (const auto& [word, times] : words_) {
      if (++shown > 7) return all + ", ...";
      all += fmt::format("{}{} {}", all.empty() ? "" : ", ", word, times);
    }
    return all;
  }

 private:
  std::vector<std::pair<std::string, int>> words_;
};

struct Row {
  Said trust;
  double worst_xy = 0.0;  ///< errors in sigmas
  double worst_yaw = 0.0;
  double worst_m = 0.0;
  double end_m = 0.0;
  double end_sigma_m = 0.0;
  double after_fix_m = -1.0;  ///< at the first fix that was applied after the fault
  int fixes = 0;
};

Row run(const ground::Dataset& data, const std::vector<std::uint8_t>& map, const Fault& fault) {
  Row row;
  LocalizerParams params;
  const StereoRig rig = ground::rig_of(data);
  if (fault.masked) {
    const int from = static_cast<int>((1.0 - fault.share) * rig.height_px);
    params.vo.own.cover({0, from, rig.width_px, rig.height_px});
    params.boulders.own = params.vo.own;
  }
  const std::size_t back = kBefore + fault.length;
  host::reset();
  host::on_telemetry([&](const std::uint8_t* bytes, std::size_t size) {
    app::FrameReport frame;
    app::FixReport fix;
    if (app::decode(bytes, size, frame) == app::PacketStatus::kGood) {
      const Pose3 truth = *data.truth_cam(frame.number);
      row.trust.add(ground::trust_name(frame.trust));
      row.end_m = std::hypot(frame.T_map_cam.t.x() - truth.t.x(), frame.T_map_cam.t.y() - truth.t.y());
      row.end_sigma_m = static_cast<double>(frame.sigma_xy_m);
      const double yaw_rad = wrap_angle(planar(frame.T_map_cam).yaw_rad - planar(truth).yaw_rad);
      row.worst_m = std::fmax(row.worst_m, row.end_m);
      row.worst_xy = std::fmax(row.worst_xy, row.end_m / row.end_sigma_m);
      row.worst_yaw = std::fmax(row.worst_yaw, std::fabs(yaw_rad) / static_cast<double>(frame.sigma_yaw_rad));
    } else if (app::decode(bytes, size, fix) == app::PacketStatus::kGood) {
      const bool applied = fix.status == static_cast<std::uint8_t>(FixStatus::kApplied);
      row.fixes += applied ? 1 : 0;
      if (!applied || fix.number < back || row.after_fix_m >= 0.0) return;
      const Vec3 at = app::root.localizer().T_map_cam().t - data.truth_cam(fix.number)->t;
      row.after_fix_m = std::hypot(at.x(), at.y());
    }
  });
  if (app::root.init(params, rig) != LocalizerStatus::kReady) return row;
  app::Command start;
  start.type = app::CommandType::kSetStart;
  start.pose = *data.truth_rover(0);
  start.number = {kSigmaXy_m, kSigmaYaw_rad};
  command(start);
  host::load_map_bank(map);
  command(app::Command());
  run_until_idle();
  const bool swapped = fault.name.find("swapped") != std::string::npos;
  for (std::size_t i = 0; i < std::min(back + kAfter, data.size()); ++i) {
    if (fault.priors && i > 0) {
      app::Command prior;
      prior.type = app::CommandType::kMotionPrior;
      prior.pair = static_cast<std::uint32_t>(i);
      prior.pose = data.truth_cam(i - 1)->inverse() * *data.truth_cam(i);
      prior.pose.t *= kSlip;
      command(prior);
    }
    for (const Delivery& d : fault.deliver(i)) {
      const bool sides_swapped = swapped && in_fault(i, fault.length);
      host::feed_pair(static_cast<std::uint32_t>(d.number), 100'000 * (1 + d.number),
                      picture(data, fault, d.left, sides_swapped),
                      picture(data, fault, d.right, !sides_swapped));
      run_until_idle();
    }
  }
  return row;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    fmt::print(stderr, "usage: fault_table FOLDER [WORD...]\n");
    return 2;
  }
  const std::string folder = argv[1];
  const std::vector<std::string> words(argv + 2, argv + argc);
  const ground::Dataset data = ground::Dataset::open(folder);
  std::vector<ground::TableBoulder> rocks = ground::read_csv(folder + "/truth_rocks.csv");
  const std::vector<std::uint8_t> map = ground::encode_cmap(rocks, ground::extent_of(rocks), 0.001, {});
  fmt::print(
      "| fault | trust, frames | worst error, sigmas: x, y; yaw | worst error | after the next fix | "
      "end; its sigma |\n|---|---|---|---|---|---|\n");
  bool honest = true;
  for (const Fault& fault : faults()) {
    const auto named = [&](const std::string& word) { return fault.name.find(word) != std::string::npos; };
    if (!words.empty() && std::none_of(words.begin(), words.end(), named)) continue;
    const Row row = run(data, map, fault);
    honest = honest && row.worst_xy <= 3.0 && row.worst_yaw <= 3.0;
    fmt::print("| {} | {} | {:.1f}; {:.1f} | {:.3f} m | {} | {:.3f} m; {:.3f} m |\n", fault.name,
               row.trust.text(), row.worst_xy, row.worst_yaw, row.worst_m,
               row.after_fix_m < 0.0 ? std::string("none") : fmt::format("{:.3f} m", row.after_fix_m),
               row.end_m, row.end_sigma_m);
    std::fflush(stdout);
  }
  return honest ? 0 : 1;
}
