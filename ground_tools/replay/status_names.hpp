/// Names of flight statuses for reports; the order is that of the enumerators.
#pragma once

#include <cstdint>
#include <string>

namespace cairn::ground {

std::string pose_source_name(std::uint8_t value);      ///< PoseSource
std::string pair_status_name(std::uint8_t value);      ///< app::PairStatus
std::string vo_status_name(std::uint8_t value);        ///< VoStatus
std::string observe_status_name(std::uint8_t value);   ///< ObserveStatus
std::string fix_status_name(std::uint8_t value);       ///< FixStatus
std::string map_fix_status_name(std::uint8_t value);   ///< MapFixStatus
std::string watch_status_name(std::uint8_t value);     ///< WatchStatus
std::string attitude_status_name(std::uint8_t value);  ///< AttitudeStatus
std::string trust_name(std::uint8_t value);
std::string map_status_name(std::uint8_t value);  ///< MapStatus
std::string task_name(std::uint8_t value);        ///< cfg::Task

}  // namespace cairn::ground
