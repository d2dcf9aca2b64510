#include "replay/pictures.hpp"

#include <algorithm>
#include <cmath>

#include "base/json_file.hpp"
#include "plot/jpeg.hpp"

namespace cairn::ground {
namespace {

using nlohmann::ordered_json;

/// Label, count, label, count ... over all pixels, row by row.
ordered_json runs_of(const ImageU8& labels) {
  ordered_json runs = ordered_json::array();
  int label = -1;
  int count = 0;
  const auto close = [&] {
    if (count == 0) return;
    runs.push_back(label);
    runs.push_back(count);
  };
  for (int y = 0; y < labels.height; ++y) {
    for (int x = 0; x < labels.width; ++x) {
      if (labels.at(x, y) != label) {
        close();
        label = labels.at(x, y);
        count = 0;
      }
      ++count;
    }
  }
  close();
  return runs;
}

}  // namespace

PictureRecorder::PictureRecorder(std::size_t count, std::size_t first, std::size_t end) {
  const std::size_t frames = end > first ? end - first : 0;
  count = std::min(count, frames);
  for (std::size_t i = 0; i < count; ++i) chosen_.push_back(first + (2 * i + 1) * frames / (2 * count));
}

void PictureRecorder::watch(const ReplayFrame& frame, const host::Picture& left) {
  if (chosen_.empty()) return;
  follow_labels();
  const auto next = std::lower_bound(chosen_.begin(), chosen_.end(), frame.index);
  if (next == chosen_.end()) return;
  const std::size_t ahead = *next - frame.index;
  if (ahead % kStride != 0 || ahead / kStride >= kStrip) return;
  // Strips of frames chosen close together may overlap; a frame then stands in one of them alone.
  before_.emplace_back(*next, frame_json(frame, left, ahead == 0));
  if (ahead != 0) return;
  ordered_json strip = ordered_json::array();
  for (const auto& [of, json] : before_) {
    if (of == *next) strip.push_back(json);
  }
  strips_.push_back(std::move(strip));
  before_.clear();
}

void PictureRecorder::follow_labels() {
  const BoulderObserver& observer = app::root.localizer().observer();
  if (observer.status() != ObserveStatus::kBoulders) return;
  std::vector<std::uint32_t> now;
  for (const BoulderSighting& s : observer.result()) {
    const bool goes_on = s.previous != 0 && s.previous <= labels_.size();
    now.push_back(goes_on ? labels_[s.previous - 1U] : next_label_++);
  }
  labels_ = std::move(now);
}

ordered_json PictureRecorder::frame_json(const ReplayFrame& frame, const host::Picture& left,
                                         bool with_regions) const {
  const Localizer& localizer = app::root.localizer();
  const BoulderObserver& observer = localizer.observer();
  const Pose3& T_map_cam = frame.report.T_map_cam;
  const Vec3 ahead = T_map_cam.q * Vec3(0.0, 0.0, 1.0);
  ordered_json json = {
      {"frame", frame.report.number},
      {"width", left.width},
      {"height", left.height},
      {"jpeg",
       left.pixels.empty() ? std::string() : jpeg_base64(left.pixels, left.width, left.height, 1, 80)},
      {"camera_m", {rounded(T_map_cam.t.x()), rounded(T_map_cam.t.y())}},
      {"heading_rad", rounded(std::atan2(ahead.y(), ahead.x()))}};
  ordered_json points = ordered_json::array();
  ordered_json boulders = ordered_json::array();
  if (observer.status() == ObserveStatus::kBoulders) {
    for (const SurfacePoint& p : observer.surface()) {
      if (!p.raised) continue;
      const std::uint8_t sighting = observer.sighting_of(p);
      const Vec2 p_map_m = localizer.T_map_site() * Vec2(p.p_site_m.x(), p.p_site_m.y());
      points.push_back({p.u, p.v, rounded(p_map_m.x()), rounded(p_map_m.y()), p.label,
                        sighting == 0 ? 0U : labels_[sighting - 1U]});
    }
    for (std::size_t i = 0; i < observer.result().size(); ++i) {
      const BoulderSighting& s = observer.result()[i];
      const Vec2 p_map_m = localizer.T_map_site() * Vec2(s.p_site_m.x(), s.p_site_m.y());
      boulders.push_back({labels_[i], rounded(p_map_m.x()), rounded(p_map_m.y()), rounded(s.diameter_m),
                          s.points, s.previous == 0 ? 0 : 1});
    }
  }
  json["points"] = std::move(points);
  json["boulders"] = std::move(boulders);
  const LabelView labels = observer.segmentation().labels();
  if (with_regions && labels.image.data != nullptr) {
    json["regions"] = {{"width", labels.image.width},
                       {"height", labels.image.height},
                       {"divisor", labels.divisor},
                       {"runs", runs_of(labels.image)}};
  }
  return json;
}

}  // namespace cairn::ground
