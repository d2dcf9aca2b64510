// cairn tape: packs a drive and its map into one piece of memory, for targets without a file system.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "base/output_file.hpp"
#include "base/progress_line.hpp"
#include "base/tool_error.hpp"
#include "cmap/cmap_file.hpp"
#include "cmap/upload_packets.hpp"
#include "commands/commands.hpp"
#include "commands/frame_range.hpp"
#include "core/big_endian.hpp"
#include "dataset/dataset.hpp"
#include "platform/tape/tape_format.hpp"
#include "replay/replay.hpp"

namespace cairn::ground {
namespace {

namespace fs = std::filesystem;
using tape::Record;

struct TapeOptions {
  fs::path dataset;
  fs::path map;
  fs::path output;
  std::string frames;
};

class Bytes {
 public:
  void u32(std::uint32_t v) {
    std::uint8_t b[4];
    be::put_u32(b, v);
    append(b, sizeof b);
  }
  void u64(std::uint64_t v) {
    std::uint8_t b[8];
    be::put_u64(b, v);
    append(b, sizeof b);
  }
  void f64(double v) {
    std::uint8_t b[8];
    be::put_f64(b, v);
    append(b, sizeof b);
  }
  void append(const std::uint8_t* bytes, std::size_t size) {
    bytes_.insert(bytes_.end(), bytes, bytes + size);
  }
  const std::vector<std::uint8_t>& get() const { return bytes_; }

 private:
  std::vector<std::uint8_t> bytes_;
};

void write_record(OutputFile& file, Record record, const std::vector<std::uint8_t>& body) {
  Bytes header;
  header.u32(static_cast<std::uint32_t>(record));
  header.u32(static_cast<std::uint32_t>(body.size()));
  file.write(header.get());
  file.write(body);
  file.write(std::vector<std::uint8_t>((4 - body.size() % 4) % 4));
}

std::vector<std::uint8_t> rig_body(const StereoRig& rig) {
  Bytes out;
  out.u32(static_cast<std::uint32_t>(rig.width_px));
  out.u32(static_cast<std::uint32_t>(rig.height_px));
  for (const double v : {rig.fx_px, rig.fy_px, rig.cx_px, rig.cy_px, rig.baseline_m}) out.f64(v);
  return out.get();
}

std::vector<std::uint8_t> pair_body(const FrameTag& tag, const PairImages& pair) {
  Bytes out;
  out.u32(static_cast<std::uint32_t>(tag.number));
  out.u64(static_cast<std::uint64_t>(tag.stamp_s * 1.0e6));
  for (const Image* image : {&pair.left, &pair.right}) {
    out.u32(static_cast<std::uint32_t>(image->width));
    out.u32(static_cast<std::uint32_t>(image->height));
  }
  for (const Image* image : {&pair.left, &pair.right}) out.append(image->pixels.data(), image->pixels.size());
  return out.get();
}

void write_tape(const TapeOptions& options) {
  const Dataset drive = Dataset::open(options.dataset);
  const FrameRange range = options.frames.empty() ? FrameRange() : parse_frames(options.frames);
  const std::size_t end = std::min(range.end, drive.size());
  if (range.first >= end) {
    throw ToolError("{}: has {} frames; --frames must give a range within 0:{}", drive.name(), drive.size(),
                    drive.size());
  }
  const auto rover = drive.truth_rover(range.first);
  if (!rover) {
    throw ToolError("{}: has no true pose of the rover to start from; add it in truth_rover.txt",
                    drive.name());
  }

  std::vector<std::uint8_t> map;
  if (!options.map.empty()) {
    map = read_file(options.map);
    static_cast<void>(decode_cmap(map, options.map.string()));  // refuses what is none
  }

  OutputFile file(options.output);
  Bytes header;
  header.u32(tape::kMagic);
  header.u32(tape::kVersion);
  file.write(header.get());
  write_record(file, Record::kRig, rig_body(drive.rig()));
  app::Command start;
  start.type = app::CommandType::kSetStart;
  start.pose = *rover;
  start.number[0] = 0.05;
  start.number[1] = 0.01;
  write_record(file, Record::kTelecommand, packet_of(start));
  if (!options.map.empty()) {
    write_record(file, Record::kMapBank, map);
    write_record(file, Record::kTelecommand, packet_of(app::Command{}));
  }
  ProgressLine progress("tape");
  for (std::size_t i = range.first; i < end; ++i) {
    write_record(file, Record::kPair, pair_body(drive.tag(i), drive.images(i)));
    progress.show(static_cast<double>(i + 1 - range.first) / static_cast<double>(end - range.first));
  }
  write_record(file, Record::kEnd, {});
  file.commit();
  fmt::print("{}: {} pairs{}\n", options.output.string(), end - range.first,
             options.map.empty() ? "" : " and a map");
}

}  // namespace

void add_tape_command(Command app) {
  const auto options = std::make_shared<TapeOptions>();
  Command command = app.add_command("tape",
                                    "Pack a drive and its map for a target without a file "
                                    "system");
  command.add_option("--dataset", options->dataset, "folder of stereo pairs, with truth").required();
  command.add_option("--map", options->map, "flight map (.cmap)");
  command.add_option("--frames", options->frames, "FIRST:END, counted from 0");
  command.add_option("-o,--output", options->output, "the tape").written().required();
  command.on_run([options] { write_tape(*options); });
}

}  // namespace cairn::ground
