// cairn map quicklook
#include <fmt/format.h>

#include <filesystem>
#include <memory>

#include "base/progress_line.hpp"
#include "commands/cmd_map.hpp"
#include "map/quicklook.hpp"

namespace cairn::ground {
namespace {

namespace fs = std::filesystem;

struct QuicklookOptions {
  fs::path map;
  fs::path output;
  QuicklookParams params;
  bool json = false;
};

void quicklook(QuicklookOptions& options) {
  const CmapContent map = load_map(options.map);
  QuicklookFacts facts;
  {
    ProgressLine line(fmt::format("map quicklook {}", options.map.filename().string()));
    options.params.progress = [&](double share) { line.show(share); };
    facts = write_quicklook(options.output, map.boulders, map.extent, map.reference_system, options.params);
  }
  if (options.json) {
    print_json({{"file", options.map.string()},
                {"picture", options.output.string()},
                {"boulders", map.boulders.size()},
                {"width_px", facts.width_px},
                {"height_px", facts.height_px},
                {"pixel_m", facts.pixel_m}});
    return;
  }
  fmt::print("{}: {} boulders, {} x {} pixels of {:.4g} m\n", options.output.string(), map.boulders.size(),
             facts.width_px, facts.height_px, facts.pixel_m);
}

}  // namespace

void add_map_quicklook(Command map) {
  const auto shown = std::make_shared<QuicklookOptions>();
  QuicklookOptions& q = *shown;
  Command quicklook_app = map.add_command("quicklook", "draw a map's boulders over the orthoimage");
  quicklook_app.add_option("MAP", q.map, "map (.cmap)").required();
  quicklook_app.add_option("-o,--output", q.output, "picture to write (.png), with .png.aux.xml beside it")
      .written()
      .required();
  quicklook_app.add_option("--ortho", q.params.ortho, "orthoimage to draw on (default: plain ground)");
  quicklook_app.add_option("--band", q.params.band, "band of the orthoimage (default: as for map build)")
      .positive();
  quicklook_app.add_option("--max-side", q.params.max_side_px, "longest side of the picture, pixels")
      .default_shown();
  quicklook_app.add_flag("--json", q.json, "one JSON object on stdout");
  quicklook_app.on_run([shown] { quicklook(*shown); });
}

}  // namespace cairn::ground
