// cairn bench: what a frame costs.
#include <fmt/format.h>

#include <algorithm>
#include <ctime>
#include <filesystem>
#include <functional>
#include <memory>
#include <vector>

#include "app/flight_app.hpp"
#include "base/statistics.hpp"
#include "base/tool_error.hpp"
#include "commands/commands.hpp"
#include "dataset/dataset.hpp"
#include "dataset/image.hpp"
#include "replay/replay.hpp"

namespace cairn::ground {
namespace {

struct BenchOptions {
  std::filesystem::path dataset;
  int frames = 40;
  int rounds = 3;
};

/// Of the process: what runs beside it on the machine does not count.
double cpu_ms() { return 1e3 * static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

/// Times and operations of one task over the frames.
struct Series {
  std::vector<double> ms;
  std::vector<double> mops;
};

double longest(const std::vector<double>& v) {
  return v.empty() ? 0.0 : *std::max_element(v.begin(), v.end());
}

void measure(Series& series, const std::function<void(WorkBudget&)>& work) {
  WorkBudget budget = WorkBudget::unlimited();
  const double begun = cpu_ms();
  work(budget);
  series.ms.push_back(cpu_ms() - begun);
  series.mops.push_back(1e-6 * static_cast<double>(budget.spent()));
}

void print_series(const char* name, const Series& s) {
  fmt::print("  {:<28} {:>8.2f} {:>8.2f}   {:>8.2f} {:>8.2f}   {:>6.2f}\n", name, median(s.ms), longest(s.ms),
             median(s.mops), longest(s.mops), 1e6 * median(s.ms) / (1e6 * std::max(1e-9, median(s.mops))));
}

void bench(const BenchOptions& options) {
  const Dataset dataset = Dataset::open(options.dataset);
  const StereoRig rig = rig_of(dataset);
  static Localizer localizer;  // too large for a stack
  const std::size_t count = std::min(dataset.frames().size(), static_cast<std::size_t>(options.frames));
  std::vector<std::pair<Image, Image>> images;
  for (std::size_t i = 0; i < count; ++i) {
    images.emplace_back(load_grey(dataset.frames()[i].left), load_grey(dataset.frames()[i].right));
  }
  Series vo;
  Series boulders;
  Series whole;
  for (int round = 0; round < options.rounds; ++round) {
    if (localizer.init(LocalizerParams(), rig) != LocalizerStatus::kReady ||
        localizer.set_start(Pose3(), 0.05, 0.01) != LocalizerStatus::kReady) {
      throw ToolError("{}: does not fit mission '{}'; build with another MISSION", options.dataset.string(),
                      cfg::kMission.name);
    }
    for (std::size_t i = 0; i < count; ++i) {
      if (localizer.begin_frame(images[i].first.view(), images[i].second.view(), nullptr) !=
          LocalizerStatus::kReady) {
        throw ToolError("{}: frame {} was refused; check the data set", options.dataset.string(), i);
      }
      measure(vo, [&](WorkBudget& b) { (void)localizer.step_vo(b); });
      measure(boulders, [&](WorkBudget& b) { (void)localizer.step_boulders(b); });
      whole.ms.push_back(vo.ms.back() + boulders.ms.back());
      whole.mops.push_back(vo.mops.back() + boulders.mops.back());
    }
  }
  fmt::print("{} x {}, {} frames, {} rounds, one core\n", rig.width_px, rig.height_px, count, options.rounds);
  fmt::print("  {:<28} {:>17}   {:>17}   {:>6}\n", "", "CPU ms a frame", "million operations", "ns/op");
  fmt::print("  {:<28} {:>8} {:>8}   {:>8} {:>8}\n", "", "median", "longest", "median", "longest");
  print_series("visual odometry", vo);
  print_series("segmentation and boulders", boulders);
  print_series("whole frame", whole);
  fmt::print("Times hold for this machine only; operations are the same everywhere.\n");
}

}  // namespace

void add_bench_command(Command app) {
  const auto options = std::make_shared<BenchOptions>();
  Command command = app.add_command("bench", "Time and operations of the flight module per frame");
  command.add_option("--dataset", options->dataset, "folder of stereo pairs").required();
  command.add_option("--frames", options->frames, "frames to use, at most").within(2, 100000);
  command.add_option("--rounds", options->rounds, "times to go over them").within(1, 1000);
  command.on_run([options] { bench(*options); });
}

}  // namespace cairn::ground
