/// The report as one HTML page that needs nothing else: no network, no other file, no library.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace cairn::ground {

/// `runs`: what read_run_folder gives, at least one. Names are made different where they are not. A
/// content-security policy in the page forbids it to load anything.
std::string report_page(std::vector<nlohmann::ordered_json> runs);

/// Parts of the page, the same for every report. The script finds its data in the element `data`.
extern const char* const kPageBody;    ///< page_body.cpp
extern const char* const kPageScript;  ///< page_script.cpp

}  // namespace cairn::ground
