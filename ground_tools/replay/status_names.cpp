#include "replay/status_names.hpp"

#include <cstddef>

#include "app/pair_order.hpp"
#include "localizer/localizer.hpp"
#include "schedule.hpp"

namespace cairn::ground {
namespace {

template <std::size_t Count, std::size_t N>
std::string pick(const char* const (&names)[N], std::uint8_t value) {
  static_assert(N == Count, "a name for each enumerator");
  return value < N ? names[value] : "unknown" + std::to_string(value);
}

}  // namespace

std::string pose_source_name(std::uint8_t value) {
  static const char* const names[] = {"none", "start", "vo", "held", "extrapolated", "prior", "doubted"};
  return pick<kPoseSourceCount>(names, value);
}

std::string pair_status_name(std::uint8_t value) {
  static const char* const names[] = {"first", "next", "gap", "renumbered", "repeated", "old"};
  return pick<app::kPairStatusCount>(names, value);
}

std::string vo_status_name(std::uint8_t value) {
  static const char* const names[] = {"idle",         "running",      "first_frame", "motion",
                                      "bad_image",    "few_features", "few_stereo",  "few_matches",
                                      "no_consensus", "implausible"};
  return pick<kVoStatusCount>(names, value);
}

std::string observe_status_name(std::uint8_t value) {
  static const char* const names[] = {"idle",       "running",   "boulders", "no_boulders",
                                      "no_regions", "no_points", "bad_input"};
  return pick<kObserveStatusCount>(names, value);
}

std::string fix_status_name(std::uint8_t value) {
  static const char* const names[] = {"none",
                                      "unfinished",
                                      "applied",
                                      "no_map",
                                      "no_map_boulders",
                                      "no_local_boulders",
                                      "too_few_pairs",
                                      "weak_geometry",
                                      "iteration_limit",
                                      "beyond_limit",
                                      "bad_input",
                                      "late",
                                      "inconsistent",
                                      "no_search_room",
                                      "no_hypothesis",
                                      "too_little_evidence",
                                      "ambiguous",
                                      "chance_agreement"};
  return pick<kFixStatusCount>(names, value);
}

std::string map_fix_status_name(std::uint8_t value) {
  static const char* const names[] = {"idle",
                                      "running",
                                      "accepted",
                                      "no_map",
                                      "no_map_boulders",
                                      "no_local_boulders",
                                      "no_search_room",
                                      "no_hypothesis",
                                      "inconsistent",
                                      "too_little_evidence",
                                      "ambiguous",
                                      "chance_agreement",
                                      "weak_geometry",
                                      "bad_input",
                                      "view_disagrees"};
  return pick<kMapFixStatusCount>(names, value);
}

std::string watch_status_name(std::uint8_t value) {
  static const char* const names[] = {"clear",        "frozen",       "contradicted",
                                      "own_hardware", "mostly_still", "jumped"};
  return pick<kWatchStatusCount>(names, value);
}

std::string attitude_status_name(std::uint8_t value) {
  static const char* const names[] = {"none",         "fused",   "waiting", "passed_over",
                                      "inconsistent", "no_pose", "paper",   "bad_input"};
  return pick<kAttitudeStatusCount>(names, value);
}

std::string trust_name(std::uint8_t value) {
  static const char* const names[] = {"confirmed", "coasting", "unconfirmed", "lost", "claimed"};
  return pick<kTrustCount>(names, value);
}

std::string map_status_name(std::uint8_t value) {
  static const char* const names[] = {"none",        "checking",     "usable",          "no_map",
                                      "truncated",   "bad_magic",    "unknown_version", "header_crc",
                                      "bad_header",  "payload_crc",  "bad_directory",   "damaged",
                                      "no_boulders", "directory_crc"};
  return pick<kMapStatusCount>(names, value);
}

std::string task_name(std::uint8_t value) {
  static const char* const names[] = {"vo", "boulders", "fix_begin", "fix", "fix_apply"};
  return pick<cfg::kTaskCount>(names, value);
}

}  // namespace cairn::ground
