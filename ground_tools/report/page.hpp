/// The report as one HTML page that needs nothing else: no network, no other file, no library.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace cairn::ground {

/// `runs`: what read_run_folder gives, at least one. Names are made different where they are not. A
/// content-security policy in the page forbids it to load anything.
std::string report_page(std::vector<nlohmann::ordered_json> runs);

}  // namespace cairn::ground
